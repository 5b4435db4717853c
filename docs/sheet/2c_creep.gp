set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '2c_creep.png'
set grid
set xlabel 't [s]'
set ylabel 'creep [mm]'
set logscale y
set yrange [1e-3:1e4]
set format y '10^{%L}'
set key left top Left reverse maxrows 2
plot '2c_creep.dat' index 0 using 1:2 with lines lw 2 title 'one direction', \
     '2c_creep.dat' index 1 using 1:2 with lines lw 2 title 'pyramid, fixed tangents', \
     '2c_creep.dat' index 2 using 1:2 with lines lw 2 title 'pyramid along the slip', \
     '2c_creep.dat' index 3 using 1:2 with lines lw 2 title 'cone', \
     '2c_creep.dat' index 4 using 1:2 with lines lw 2 title 'one direction, textbook''s substep', \
     '2c_creep.dat' index 5 using 1:2 with lines lw 2 title 'Bullet'
