set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '1f_stack.png'
set grid
set size ratio -1
set xlabel 'x [m]'
set ylabel 'z [m]'
set key outside
plot '1f_stack.dat' index 0 using 1:2 with lines lw 2 title 'per-iteration clamp', \
     '1f_stack.dat' index 1 using 1:2 with lines lw 2 title 'accumulated clamp'
