set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '2d_scatter.png'
set grid
set size ratio -1
set xlabel 'α_1 / (μ λ_N)'
set ylabel 'α_2 / (μ λ_N)'
set xrange [-1.5:1.5]
set yrange [-1.5:1.5]
set key outside
set object 1 circle at 0,0 size 1 behind fillstyle empty border lc rgb 'gray'
set object 2 rectangle from -1,-1 to 1,1 behind fillstyle empty border lc rgb 'gray'
plot '2d_scatter.dat' index 0 using 1:2 with points pt 7 ps 0.5 title 'pyramid, fixed tangents', \
     '2d_scatter.dat' index 1 using 1:2 with points pt 7 ps 0.5 title 'cone'
