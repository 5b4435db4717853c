set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '1g_convergence.png'
set grid
set xlabel 'sweeps'
set ylabel 'residual [m/s]'
set logscale xy
set format y '10^{%L}'
set key left bottom
plot '1g_convergence.dat' index 0 using 1:2 with linespoints lw 2 title 'per-iteration clamp', \
     '1g_convergence.dat' index 1 using 1:2 with linespoints lw 2 title 'accumulated clamp', \
     '1g_convergence.dat' index 2 using 1:2 with linespoints lw 2 title 'accumulated, over-relaxed 1.3', \
     '1g_convergence.dat' index 3 using 1:2 with linespoints lw 2 title 'accumulated, NNCG'
