"""Makes the meshes of this folder: python make_meshes.py (pip install gmsh==4.15.2)."""

import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Verbosity", 2)
gmsh.option.setNumber("Mesh.ElementOrder", 1)
gmsh.option.setNumber("Mesh.RandomSeed", 1)


def save(name, version=4.1, binary=0, parametric=0):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.option.setNumber("Mesh.SaveParametric", parametric)
    gmsh.write(name)


def group(dimension, entities, name):
    gmsh.model.addPhysicalGroup(dimension, entities, name=name)


def faces_at(axis, value):
    box = [-9.0] * 3 + [9.0] * 3
    box[axis], box[axis + 3] = value - 1e-6, value + 1e-6
    return [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, 2)]


# A box 2 x 1 x 1, unstructured; "fixed" and "load" are part of "surface".
gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
gmsh.model.occ.synchronize()
group(2, faces_at(0, 0.0), "fixed")
group(2, faces_at(0, 2.0), "load")
group(2, [tag for _, tag in gmsh.model.getEntities(2)], "surface")
group(3, [1], "body")
gmsh.option.setNumber("Mesh.MeshSizeMin", 0.8)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.8)
gmsh.model.mesh.generate(3)
for order in (1, 2, 3):
    gmsh.model.mesh.setOrder(order)
    save(f"box-tet{(0, 4, 10, 20)[order]}.msh")
    save(f"box-tet{(0, 4, 10, 20)[order]}-binary.msh", binary=1)
gmsh.model.mesh.setOrder(1)
save("box-parametric.msh", parametric=1)
save("box-parametric-binary.msh", binary=1, parametric=1)
save("box-version-2.2.msh", version=2.2)
save("box-version-2.2-binary.msh", version=2.2, binary=1)
save("box-version-4.0.msh", version=4.0)

# A quarter of a ring, radii 1 and 2, height 1; the round sides are curved.
gmsh.clear()
outer = gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 1, 2, angle=1.5707963267948966)
inner = gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 1, 1, angle=1.5707963267948966)
gmsh.model.occ.cut([(3, outer)], [(3, inner)])
gmsh.model.occ.synchronize()
group(2, faces_at(0, 0.0), "fixed")
group(2, [tag for _, tag in gmsh.model.getEntities(2)], "surface")
group(3, [tag for _, tag in gmsh.model.getEntities(3)], "body")
gmsh.option.setNumber("Mesh.MeshSizeMin", 1.0)
gmsh.option.setNumber("Mesh.MeshSizeMax", 1.0)
gmsh.model.mesh.generate(3)
for order in (2, 3):
    gmsh.model.mesh.setOrder(order)
    save(f"ring-tet{(0, 4, 10, 20)[order]}.msh")
gmsh.finalize()
