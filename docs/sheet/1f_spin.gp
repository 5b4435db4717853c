set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '1f_spin.png'
set grid
set xlabel 'sweeps'
set ylabel 'ω [rad/s]'
set logscale xy
set format y '10^{%L}'
set key left bottom
plot '1f_spin.dat' index 0 using 1:2 with linespoints lw 2 title 'per-iteration clamp', \
     '1f_spin.dat' index 1 using 1:2 with linespoints lw 2 title 'accumulated clamp'
