// Clip for a cable of 12 mm, the right half of it: a C-shaped arm on a foot. Lengths in mm. The cable's
// axis is z and its centre, seated, is the origin; the opening looks towards +y; x = 0 is the plane of
// symmetry. Commands: see README.md.

SetFactory("Built-in");
ri = 6.1;                    // inside: 0.1 mm play round the cable
t = 1.4;                     // wall
ro = ri + t;
b = 8;                       // width along z
half = 60 * Pi / 180;        // half opening, from +y
root = 25 * Pi / 180;        // where the arm leaves the foot, from -y
bottom = ro + 2;             // underside of the foot below the cable's axis

h = 1.6;                     // size of elements along the arm
hf = 2.2;                    // in the foot
n = 3;                       // layers across the width

Point(1) = {0, 0, 0, h};
Point(2) = {0, -ri, 0, hf};
Point(3) = {ri * Sin(root), -ri * Cos(root), 0, h};
Point(4) = {ri, 0, 0, h};
Point(5) = {ri * Sin(half), ri * Cos(half), 0, h};   // the lip's inner edge: what touches
Point(6) = {ro * Sin(half), ro * Cos(half), 0, h};
Point(7) = {ro, 0, 0, h};
Point(8) = {ro * Sin(root), -ro * Cos(root), 0, h};
Point(9) = {ro * Sin(root), -bottom, 0, hf};
Point(10) = {0, -bottom, 0, hf};
Circle(1) = {2, 1, 3};
Circle(2) = {3, 1, 4};       // inside of the arm
Circle(3) = {4, 1, 5};
Line(4) = {5, 6};            // end of the lip
Circle(5) = {6, 1, 7};       // outside
Circle(6) = {7, 1, 8};
Line(7) = {8, 9};
Line(8) = {9, 10};           // underside
Line(9) = {10, 2};           // plane of symmetry
Curve Loop(1) = {1:9};
Plane Surface(1) = {1};

// [0] the far end, [1] the volume, [1 + i] the side over line i.
out[] = Extrude {0, 0, b} { Surface{1}; Layers{n}; };

Physical Volume("body", 1) = {out[1]};
Physical Surface("sym_x", 2) = {out[10]};
Physical Surface("fixed", 3) = {out[{8, 9}]};   // underside and side: the foot stands in a pocket
Physical Surface("contact", 4) = {out[{2, 3, 4, 5}]};

Mesh.ElementOrder = 2;
Mesh.SecondOrderLinear = 0;  // mid nodes on the arcs
Mesh.Algorithm = 6;          // frontal-Delaunay
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 0;
Mesh.SaveAll = 0;
