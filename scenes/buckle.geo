// Buckle, the half that is pushed into the window: two arms on a bridge, each with a catch that points
// outwards. Lengths in mm. The arms lie along y from their roots at y = 0; x = 0 is the middle.
// Commands: see README.md.

SetFactory("Built-in");
l = 22;                      // root to the catch's crest
t = 2.5;                     // thickness of an arm
b = 6;                       // width along z
xo = 10;                     // outside of the arms
catch = 1.7;                 // height of the catch: 1.5 undercut and 0.2 play
lead = 45 * Pi / 180;        // the catch's own flanks, steeper than those of the window
back = 62 * Pi / 180;
tip = 2.2;                   // crest to the end of the arm
bridge = 6;                  // depth of the bridge

h = 2.6;                     // size of elements along the arms
hc = 1.4;                    // at the catch
hb = 3.6;                    // in the bridge
n = 3;                       // layers across the width

xi = xo - t;
xc = xo + catch;
Point(1) = {-xi, 0, 0, h};
Point(2) = {xi, 0, 0, h};
Point(3) = {xi, l + tip, 0, hc};
Point(4) = {xc - tip * Tan(lead), l + tip, 0, hc};
Point(5) = {xc, l, 0, hc};                          // crest, right: an edge of the mesh, what touches
Point(6) = {xo, l - catch / Tan(back), 0, hc};
Point(7) = {xo, 0, 0, h};
Point(8) = {xo, -bridge, 0, hb};
Point(9) = {-xo, -bridge, 0, hb};
Point(10) = {-xo, 0, 0, h};
Point(11) = {-xo, l - catch / Tan(back), 0, hc};
Point(12) = {-xc, l, 0, hc};                        // crest, left
Point(13) = {-xc + tip * Tan(lead), l + tip, 0, hc};
Point(14) = {-xi, l + tip, 0, hc};
For i In {1:13}
  Line(i) = {i, i + 1};
EndFor
Line(14) = {14, 1};
Curve Loop(1) = {1:14};
Plane Surface(1) = {1};

// [0] the far end, [1] the volume, [1 + i] the side over line i.
out[] = Extrude {0, 0, b} { Surface{1}; Layers{n}; };

Physical Volume("body", 1) = {out[1]};
Physical Surface("fixed", 2) = {out[9]};
Physical Surface("contact", 3) = {out[{5, 6, 12, 13}]};

Mesh.ElementOrder = 2;
Mesh.Algorithm = 6;          // frontal-Delaunay
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 0;
Mesh.SaveAll = 0;
