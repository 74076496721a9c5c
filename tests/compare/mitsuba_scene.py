"""A scene for Mitsuba: meshes by way of PLY files, the floor apart."""

import numpy


def write_ply(path, caster):
    """A mesh with its vertex normals."""
    vertices = numpy.hstack([caster.positions, caster.normals]).astype("<f4")
    faces = numpy.empty(len(caster.triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, caster.triangles
    names = "".join(f"property float {name}\n" for name in ["x", "y", "z", "nx", "ny", "nz"])
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{names}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(head.encode() + vertices.tobytes() + faces.tobytes())


def casters(scene, folder, colour):
    """Mitsuba's description of what is specular. Each event multiplies light by `colour`, of linear RGB."""
    tint = {"type": "rgb", "value": colour}
    shapes = {}
    for number, caster in enumerate(scene.casters):
        path = folder / f"caster{number}.ply"
        write_ply(path, caster)
        if caster.ior is None:
            mirror = {"type": "conductor", "material": "none", "specular_reflectance": tint}
            material = {"type": "twosided", "bsdf": mirror}
        else:
            material = {"type": "dielectric", "int_ior": caster.ior, "ext_ior": 1.0,
                        "specular_reflectance": tint, "specular_transmittance": tint}
        shapes[f"caster{number}"] = {"type": "ply", "filename": str(path), "bsdf": material}
    return shapes


def floor(mi, scene, albedo):
    """The floor, matte above and black below."""
    half = 0.5 * scene.side_m
    world_from_object = (
        mi.ScalarTransform4f()
        .translate([scene.x0 + half, scene.height_m, scene.z0 + half])
        .rotate([1, 0, 0], -90)
        .scale([half, half, half])
    )
    return {"type": "rectangle", "to_world": world_from_object,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}}}
