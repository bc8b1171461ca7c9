// Window that the arms of buckle.toml are pushed into, the rigid tool: a frame as a closed STL. Lengths
// in mm. It goes over the arms towards -y; its throat is y = 0. Commands: see README.md.

SetFactory("OpenCASCADE");
throat = 10.2;               // half width at the throat: 0.2 mm play beside the arms
mouth = 12.4;                // half width at the mouth
outer = 15;                  // half width outside
lead = 30 * Pi / 180;        // ramp to the direction of insertion
back = 45 * Pi / 180;        // slope behind the throat
round = 1;                   // radius of the throat
high = 3.5;                  // half height of the window, along z
plate = 1.5;                 // plates above and below it

// The right jaw's face: mouth, ramp, throat, back. The arc about (xr, 0) touches both slopes.
xr = throat + round;
xa = xr - round * Cos(lead); ya = -round * Sin(lead);
xb = xr - round * Cos(back); yb = round * Sin(back);
ym = ya - (mouth - xa) / Tan(lead);
ye = yb + (mouth - xb) / Tan(back);
Macro Jaw
  p = newp;
  Point(p) = {side * outer, ym, -high};
  Point(p + 1) = {side * mouth, ym, -high};
  Point(p + 2) = {side * xa, ya, -high};
  Point(p + 3) = {side * xr, 0, -high};
  Point(p + 4) = {side * xb, yb, -high};
  Point(p + 5) = {side * mouth, ye, -high};
  Point(p + 6) = {side * outer, ye, -high};
  c = newc;
  Line(c) = {p, p + 1};
  Line(c + 1) = {p + 1, p + 2};
  Circle(c + 2) = {p + 2, p + 3, p + 4};
  Line(c + 3) = {p + 4, p + 5};
  Line(c + 4) = {p + 5, p + 6};
  Line(c + 5) = {p + 6, p};
  f = newreg;
  Curve Loop(f) = {c:c + 5};
  Plane Surface(f) = {f};
  jaw[] = Extrude {0, 0, 2 * high} { Surface{f}; };
Return
side = 1;
Call Jaw;
right = jaw[1];
side = -1;
Call Jaw;
left = jaw[1];
top = newv;
Box(top) = {-outer, ym, high, 2 * outer, ye - ym, plate};
bottom = newv;
Box(bottom) = {-outer, ym, -high - plate, 2 * outer, ye - ym, plate};
BooleanUnion{ Volume{right}; Delete; }{ Volume{left, top, bottom}; Delete; }

// Few triangles on the flat faces. The throats' rounds are cut into 24 strips: bends of 3 degrees, half of
// which a facet's slope may be wrong by.
Mesh.MeshSizeMax = 20;
e = 1e-3;
For side In {-1:1:2}
  x = side * 0.5 * (throat + Max(xa, xb));
  wide = 0.5 * (Max(xa, xb) - throat) + e;
  rounds[] = Surface In BoundingBox {x - wide, ya - e, -high - e, x + wide, yb + e, high + e};
  For level In {-1:1:2}
    arcs[] = Curve In BoundingBox {x - wide, ya - e, level * high - e, x + wide, yb + e, level * high + e};
    Transfinite Curve {arcs[]} = 25;
  EndFor
  For y In {0:1}
    // The rounds' borders along z.
    xe = side * (y == 0 ? xa : xb); ye = y == 0 ? ya : yb;
    borders[] = Curve In BoundingBox {xe - e, ye - e, -high - e, xe + e, ye + e, high + e};
    Transfinite Curve {borders[]} = 2;
  EndFor
  Transfinite Surface {rounds[]};
EndFor
Mesh.Binary = 1;
