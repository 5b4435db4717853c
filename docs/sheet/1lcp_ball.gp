set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '1lcp_ball.png'
set grid
set xlabel 't [s]'
set ylabel 'height of the centre [m]'
plot '1lcp_ball.dat' index 0 using 1:2 with lines lw 2 title 'all three conditions', \
     '1lcp_ball.dat' index 1 using 1:2 with lines lw 2 title 'without λ C = 0'
