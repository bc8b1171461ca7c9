// Annular cap, a quarter of it: a round wall with a bead inside near its open end, closed by a
// disc with a hole for a cable. Lengths in mm. The axis is z, the open end is z = 0, and the spigot
// comes from below. x = 0 and y = 0 are planes of symmetry. Commands: see README.md.

SetFactory("Built-in");
rb = 12.0;                   // inside of the bead: its crest
ri = 12.6;                   // inside of the wall
t = 1.0;                     // wall
ro = ri + t;
zb = 1.0;                    // crest of the bead above the open end
f = ri - rb;                 // height of the bead
lead = 45 * Pi / 180;        // its flanks are steeper than the spigot's, so that its crest is what touches
back = 62 * Pi / 180;
depth = 14;                  // open end to disc
disc = 1.5;                  // thickness of the disc
hole = 6;                    // radius of its hole
n = 10;                      // elements round the quarter

h = 1.8;                     // size of elements along the wall and in the disc
hb = 0.8;                    // at the bead

Point(1) = {ri, 0, 0, hb};
Point(2) = {ri, 0, zb - f / Tan(lead), hb};
Point(3) = {rb, 0, zb, hb};  // the crest is an edge of the mesh: its nodes are what touches
Point(4) = {ri, 0, zb + f / Tan(back), hb};
Point(5) = {ri, 0, depth, h};
Point(6) = {hole, 0, depth, 2 * h};
Point(7) = {hole, 0, depth + disc, 2 * h};
Point(8) = {ro, 0, depth + disc, h};
Point(9) = {ro, 0, zb + f / Tan(back), hb};
Point(10) = {ro, 0, 0, hb};
Line(1) = {1, 2};
Line(2) = {2, 3};            // outer flank
Line(3) = {3, 4};            // inner flank
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};            // outside of the disc
Line(8) = {8, 9};
Line(9) = {9, 10};
Line(10) = {10, 1};
Curve Loop(1) = {1:10};
Plane Surface(1) = {1};

// [0] the far end, [1] the volume, [1 + i] the side over line i.
out[] = Extrude {{0, 0, 1}, {0, 0, 0}, Pi / 2} { Surface{1}; Layers{n}; };

Physical Volume("body", 1) = {out[1]};
Physical Surface("sym_y", 2) = {1};        // plane y = 0
Physical Surface("sym_x", 3) = {out[0]};   // plane x = 0
Physical Surface("fixed", 4) = {out[8]};
Physical Surface("contact", 5) = {out[{3, 4}]};

Mesh.ElementOrder = 2;
Mesh.SecondOrderLinear = 0;  // mid nodes on the true circles
Mesh.Algorithm = 6;          // frontal-Delaunay
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 0;
Mesh.SaveAll = 0;
