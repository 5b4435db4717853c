set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '2f_maze.png'
set grid
set xlabel 't [s]'
set ylabel 'distance [m]'
set logscale y
set key right bottom
plot '2f_maze.dat' index 0 using 1:2 with lines lw 2 title 'textbook from zero, 10 sweeps', \
     '2f_maze.dat' index 1 using 1:2 with lines lw 2 title 'textbook, warm, 10 sweeps', \
     '2f_maze.dat' index 2 using 1:2 with lines lw 2 title 'Cairn''s default substep (`si`)', \
     '2f_maze.dat' index 3 using 1:2 with lines lw 2 title 'Cairn as it comes (`auto`)', \
     '2f_maze.dat' index 4 using 1:2 with lines lw 2 title 'Bullet'
