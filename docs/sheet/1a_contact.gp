set encoding utf8
set terminal pngcairo size 760,440 font 'sans,10'
set output '1a_contact.png'
set grid
set size ratio -1
set xlabel 'x [m]'
set ylabel 'z [m]'
set xrange [-1.2:1.6]
set yrange [-0.1:2.5]
plot '1a_contact.dat' index 0 using 1:2 with lines lw 2 title 'A', \
     '1a_contact.dat' index 1 using 1:2 with lines lw 2 title 'B', \
     '1a_contact.dat' index 2 using 1:2:3:4 with vectors head filled lw 1.5 title 'to r_1', \
     '1a_contact.dat' index 3 using 1:2:3:4 with vectors head filled lw 1.5 title 'to r_2', \
     '1a_contact.dat' index 4 using 1:2:3:4 with vectors head filled lw 2 title 'n', \
     '1a_contact.dat' index 5 using 1:2:3:4 with vectors nohead lw 2 title 'gap C_N'
