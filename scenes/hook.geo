// Cantilever snap hook as a deformable part: second-order tetrahedra, all faces flat. Lengths in
// mm. The arm lies along x from its root at x = 0, the catch rises to +y, and the mating edge comes
// from the tip along -x. Width along z.
// Commands: see README.md.

SetFactory("Built-in");
l = 20;                         // root to the catch's back
t = 2;                          // thickness
b = 6;                          // width
undercut = 1;                   // how far the arm must bend
play = 0.02;                    // between the mating edge and the arm, before and after
y = undercut + play;            // height of the catch
flat = 0.6;                     // flat top of the catch
ramp = y / Tan(30 * Pi / 180);  // lead angle 30 degrees
nose = 0.3;                     // straight tip below the ramp's start
back = 0.35;                    // the catch's back leans: 70 degrees

h = 2.2;                        // size of elements along the arm
hc = 0.8;                       // at the catch

// The arm's upper side is y = 0, its lower side y = -t.
Point(1) = {0, -t, 0, h};
Point(2) = {l + flat + ramp + nose, -t, 0, 1.5 * hc};
Point(3) = {l + flat + ramp + nose, 0, 0, hc};
Point(4) = {l + flat + ramp, 0, 0, hc};
Point(5) = {l + flat, y, 0, hc};
Point(6) = {l, y, 0, hc};
Point(7) = {l - back, 0, 0, hc};
Point(8) = {l - 6, 0, 0, 1.5 * hc};
Point(9) = {0, 0, 0, h};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};               // lead-in ramp
Line(5) = {5, 6};               // flat top
Line(6) = {6, 7};               // back
Line(7) = {7, 8};               // where the edge rests in the end
Line(8) = {8, 9};
Line(9) = {9, 1};               // root
Curve Loop(1) = {1:9};
Plane Surface(1) = {1};
// The side over line i is out[1 + i].
out[] = Extrude {0, 0, b} { Surface{1}; };

Physical Volume("body", 1) = {out[1]};
Physical Surface("surface", 2) = {1, out[0], out[{2:10}]};
Physical Surface("fixed", 3) = {out[10]};
Physical Surface("contact", 4) = {out[{4, 5, 6, 7, 8}]};

Mesh.ElementOrder = 2;
Mesh.MeshSizeExtendFromBoundary = 1;
Mesh.Algorithm = 6;          // frontal-Delaunay
Mesh.Algorithm3D = 1;        // Delaunay
Mesh.Optimize = 1;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 0;
Mesh.SaveAll = 0;
