set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '1e_sunk.png'
set grid
set xlabel 't [s]'
set ylabel 'height [m]'
plot '1e_sunk.dat' index 0 using 1:2 with lines lw 2 title 'none', \
     '1e_sunk.dat' index 1 using 1:2 with lines lw 2 title 'target velocity', \
     '1e_sunk.dat' index 2 using 1:2 with lines lw 2 title 'split', \
     '1e_sunk.dat' index 3 using 1:2 with lines lw 2 title 'soft'
