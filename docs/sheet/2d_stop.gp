set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '2d_stop.png'
set grid
set xlabel 'launch direction [°]'
set ylabel 'error [%]'
set xtics 15
set key left bottom
plot '2d_stop.dat' index 0 using 1:2 with linespoints lw 2 title 'one direction', \
     '2d_stop.dat' index 1 using 1:2 with linespoints lw 2 title 'pyramid, fixed tangents', \
     '2d_stop.dat' index 2 using 1:2 with linespoints lw 2 title 'pyramid along the slip', \
     '2d_stop.dat' index 3 using 1:2 with linespoints lw 2 title 'cone', \
     '2d_stop.dat' index 4 using 1:2 with linespoints lw 2 title 'Bullet'
