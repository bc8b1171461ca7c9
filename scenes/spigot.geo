// Spigot with a bead, the rigid tool of cap.toml: a closed surface of revolution, as an STL. Lengths
// in mm. Its axis is z, its nose points to +z, and the bead's crest is z = 0. Commands: see README.md.

SetFactory("Built-in");
n = 30;                      // facets in a quarter
// A facet is a chord, at most 0.03 % of the radius inside its circle. Two thirds of that are given back,
// so that the radius is right on the mean.
s = 1 + (Pi / (2 * n))^2 / 12;

crest = s * 12.2;            // radius of the bead: 0.2 more than the cap's
groove = s * 11.8;           // behind the bead: 0.2 less than the cap's
nose = s * 10.8;             // radius of the nose's flat end
lead = 25 * Pi / 180;        // ramp to the axis
back = 45 * Pi / 180;        // slope behind the crest
round = 0.5;                 // radius of the crest, the hollow behind it, the nose and the foot
foot = -8;                   // end of the shaft

// Arcs and the straight lines that touch them. Centres, as (radius, z): crest (rc, 0), nose (nose, zn),
// hollow (rh, zh), foot (rf, zf).
cl = Cos(lead); sl = Sin(lead);
cb = Cos(back); sb = Sin(back);
rc = crest - round;
zn = (rc - nose) * cl / sl;
rh = groove + round;
zh = -(2 * round - (rh - rc) * cb) / sb;
rf = groove - round;
zf = foot + round;

Point(1) = {0, 0, zn + round};
Point(2) = {nose, 0, zn + round};
Point(3) = {nose, 0, zn};
Point(4) = {nose + round * cl, 0, zn + round * sl};
Point(5) = {rc + round * cl, 0, round * sl};
Point(6) = {rc, 0, 0};
Point(7) = {rc + round * cb, 0, -round * sb};
Point(8) = {rh - round * cb, 0, zh + round * sb};
Point(9) = {rh, 0, zh};
Point(10) = {groove, 0, zh};
Point(11) = {groove, 0, zf};
Point(12) = {rf, 0, zf};
Point(13) = {rf, 0, foot};
Point(14) = {0, 0, foot};
Line(1) = {1, 2};
Circle(2) = {2, 3, 4};       // nose
Line(3) = {4, 5};            // ramp
Circle(4) = {5, 6, 7};       // crest
Line(5) = {7, 8};            // back
Circle(6) = {8, 9, 10};      // hollow
Line(7) = {10, 11};          // shaft
Circle(8) = {11, 12, 13};    // foot
Line(9) = {13, 14};
Transfinite Curve {1, 3, 5, 7, 9} = 2;
Transfinite Curve {2, 6} = 5;
Transfinite Curve {8} = 6;
Transfinite Curve {4} = 25;  // bends of 3 degrees: half of one is what a facet's slope may be wrong by


// Four quarters; the curves that a quarter ends with start the next one. Of a line that meets the axis
// come [0] the far curve, [1] the surface and one side, of others two sides.
ends[] = {1:9};
For quarter In {1:4}
  next[] = {};
  For i In {0:8}
    out[] = Extrude {{0, 0, 1}, {0, 0, 0}, Pi / 2} { Curve{ends[i]}; Layers{n}; };
    next[] += out[0];
  EndFor
  ends[] = next[];
EndFor

Mesh.Binary = 1;
