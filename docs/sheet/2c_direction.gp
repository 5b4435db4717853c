set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '2c_direction.png'
set grid
set xlabel 't [s]'
set ylabel 'angle [°]'
set yrange [-90:90]
set ytics 30
plot '2c_direction.dat' index 0 using 1:2 with points pt 7 ps 0.4 title 'one direction', \
     '2c_direction.dat' index 1 using 1:2 with points pt 7 ps 0.4 title 'pyramid along the slip'
