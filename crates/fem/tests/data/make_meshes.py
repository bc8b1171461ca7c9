"""Makes the meshes of this folder but for the cantilevers: python make_meshes.py (gmsh 4.15.2)."""

import math

import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)


def save(name, version=4.1, binary=0, parametric=0):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.option.setNumber("Mesh.SaveParametric", parametric)
    gmsh.write(name)


def save_in_all_versions(name):
    """Gmsh writes no binary 4.0 any more."""
    for version, binary in ((2.2, 0), (2.2, 1), (4.0, 0), (4.1, 0), (4.1, 1)):
        kind = "binary" if binary else "ascii"
        save(f"{name}{version}-{kind}.msh", version=version, binary=binary)


def faces_at_x(value):
    box = [value - 1e-6, -9, -9, value + 1e-6, 9, 9]
    return [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, 2)]


def mesh_with_groups(first, size):
    """Part of the surface is also a group of its own."""
    surface = [tag for _, tag in gmsh.model.getEntities(2)]
    body = [tag for _, tag in gmsh.model.getEntities(3)]
    gmsh.model.addPhysicalGroup(2, faces_at_x(0.0), 1, first)
    gmsh.model.addPhysicalGroup(2, surface, 2, "surface")
    gmsh.model.addPhysicalGroup(3, body, 3, "body")
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)


# A box 2 x 1 x 1.
gmsh.model.add("box")
gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
gmsh.model.occ.synchronize()
mesh_with_groups("left side", 1.2)
for order in (1, 2, 3):
    gmsh.model.mesh.setOrder(order)
    save(f"box-order{order}-ascii.msh")
    save(f"box-order{order}-binary.msh", binary=1)
gmsh.model.mesh.setOrder(1)
save("box-version2.2.msh", version=2.2)
save("box-version2.2-binary.msh", version=2.2, binary=1)
save("box-version4.0.msh", version=4.0)
save("box-parametric-ascii.msh", parametric=1)
save("box-parametric-binary.msh", binary=1, parametric=1)

# A box 2 x 1 x 1 with groups of points and curves, and a group without a name.
gmsh.model.add("groups")
gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
gmsh.model.occ.synchronize()


def in_box(dimension, *box):
    return [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, dimension)]


e = 1e-6
gmsh.model.addPhysicalGroup(0, in_box(0, -e, -e, -e, e, 1 + e, e), 1, "corners")
gmsh.model.addPhysicalGroup(1, in_box(1, -e, -e, -e, e, 1 + e, 1 + e), 2, "rim")
gmsh.model.addPhysicalGroup(2, in_box(2, -e, -e, -e, e, 1 + e, 1 + e), 3, "ends")
gmsh.model.addPhysicalGroup(2, in_box(2, 2 - e, -e, -e, 2 + e, 1 + e, 1 + e), 4)
gmsh.model.addPhysicalGroup(2, in_box(2, -e, -e, -e, 2 + e, 1 + e, 1 + e), 5, "surface")
gmsh.model.addPhysicalGroup(3, [1], 6, "body")
gmsh.option.setNumber("Mesh.MeshSizeMin", 1.2)
gmsh.option.setNumber("Mesh.MeshSizeMax", 1.2)
gmsh.model.mesh.generate(3)
gmsh.model.mesh.setOrder(2)
save_in_all_versions("groups-version")
gmsh.model.mesh.partition(3)
save_in_all_versions("groups-partitioned")

# The volume is meshed but in no group, so that Gmsh does not save it.
gmsh.model.add("no volume")
gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(2, [1], 1, "side")
gmsh.model.mesh.generate(3)
for version in (2.2, 4.0, 4.1):
    save(f"no-volume-version{version}.msh", version=version)

# A quarter of a ring, radii 1 and 2, height 1; the round sides are curved.
gmsh.model.add("ring")
outer = gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 1, 2, angle=math.pi / 2)
inner = gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 1, 1, angle=math.pi / 2)
gmsh.model.occ.cut([(3, outer)], [(3, inner)])
gmsh.model.occ.synchronize()
mesh_with_groups("fixed", 1.0)
for order in (2, 3):
    gmsh.model.mesh.setOrder(order)
    save(f"ring-tet{(10, 20)[order - 2]}.msh")
gmsh.finalize()
