// C-clip for a 20 mm tube, as a deformable part: second-order tetrahedra with mid nodes on the
// true arcs. Lengths are written in mm below and become metres here. The tube's axis is z, the
// opening looks towards +y, and the tube's axis seated is the origin.
// Commands: see README.md. Left and right are mirror images in geometry.

SetFactory("Built-in");
mm = 1e-3;
ri = 10.1 * mm;              // inner radius: 0.1 mm play round the tube
t = 2.0 * mm;                // wall
ro = ri + t;
b = 10.0 * mm;               // width along z
half = 54.0 * Pi / 180;      // half opening, from +y
lip = 1.0 * mm;              // radius of the rounded lip: half the wall
foot = 5.0 * mm;             // half width of the foot
bottom = 14.1 * mm;          // underside of the foot below the tube's axis

// Sizes chosen for 686 nodes, the number of the paper, and 301 elements; halve all three for a finer clip.
h = 5.7 * mm;                // size of elements along the arms
hl = 4.8 * mm;               // at the lips
hf = 5.5 * mm;               // in the foot

Point(1) = {0, 0, 0, h};   // centre of the arcs
s = Sin(half); c = Cos(half);
rm = ri + lip;
// Right arm: inner end, lip's centre, tip of the lip, outer end.
Point(2) = {ri * s, ri * c, 0, hl};
Point(3) = {rm * s, rm * c, 0, hl};
Point(4) = {rm * s - lip * c, rm * c + lip * s, 0, hl};
Point(5) = {ro * s, ro * c, 0, hl};
// Left arm.
Point(6) = {-ri * s, ri * c, 0, hl};
Point(7) = {-rm * s, rm * c, 0, hl};
Point(8) = {-rm * s + lip * c, rm * c + lip * s, 0, hl};
Point(9) = {-ro * s, ro * c, 0, hl};
// Foot.
Point(10) = {0, -ri, 0, h};
neck = Sqrt(ro^2 - foot^2);
Point(11) = {foot, -neck, 0, hf};
Point(12) = {foot, -bottom, 0, hf};
Point(13) = {-foot, -bottom, 0, hf};
Point(14) = {-foot, -neck, 0, hf};

Circle(1) = {2, 3, 4};       // lip, inner half
Circle(2) = {4, 3, 5};       // lip, outer half
Circle(3) = {5, 1, 11};      // outside of the right arm
Line(4) = {11, 12};
Line(5) = {12, 13};          // underside
Line(6) = {13, 14};
Circle(7) = {14, 1, 9};      // outside of the left arm
Circle(8) = {9, 7, 8};       // lip, outer half
Circle(9) = {8, 7, 6};       // lip, inner half
Circle(10) = {6, 1, 10};     // inside, left
Circle(11) = {10, 1, 2};     // inside, right

// The lips are cut into quarters, lest one element have two faces on the same round: its
// Jacobian would vanish where they meet.
Line(12) = {2, 3};
Line(13) = {3, 5};
Line(14) = {4, 3};
Line(15) = {9, 7};
Line(16) = {7, 6};
Line(17) = {8, 7};
Curve Loop(1) = {12, 13, 3, 4, 5, 6, 7, 15, 16, 10, 11};
Curve Loop(2) = {1, 14, -12};
Curve Loop(3) = {2, -13, -14};
Curve Loop(4) = {8, 17, -15};
Curve Loop(5) = {9, -16, -17};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Plane Surface(3) = {3};
Plane Surface(4) = {4};
Plane Surface(5) = {5};

// Of each: [0] the far end, [1] the volume, [2...] the side over each curve of the loop.
arms[] = Extrude {0, 0, b} { Surface{1}; };
lip1[] = Extrude {0, 0, b} { Surface{2}; };
lip2[] = Extrude {0, 0, b} { Surface{3}; };
lip3[] = Extrude {0, 0, b} { Surface{4}; };
lip4[] = Extrude {0, 0, b} { Surface{5}; };
lips[] = {lip1[2], lip2[2], lip3[2], lip4[2]};

Physical Volume("body", 1) = {arms[1], lip1[1], lip2[1], lip3[1], lip4[1]};
Physical Surface("surface", 2) = {1:5, arms[0], lip1[0], lip2[0], lip3[0], lip4[0],
                                  arms[{4:8, 11, 12}], lips[]};
Physical Surface("fixed", 3) = {arms[6]};
Physical Surface("contact", 4) = {arms[{11, 12}], lips[]};

Mesh.ElementOrder = 2;
Mesh.SecondOrderLinear = 0;  // mid nodes on the arcs
Mesh.MeshSizeExtendFromBoundary = 1;
Mesh.Algorithm = 1;          // MeshAdapt: its nodes make the smoothest curve of force here
Mesh.Algorithm3D = 1;        // Delaunay
Mesh.Optimize = 1;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 0;
Mesh.SaveAll = 0;
