# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tests of keratin_export.py, in Blender as a module. Python 3.11, from the repository's root:

    pip install bpy==4.2.23 && python tools/blender/test_keratin_export.py

(`bpy==4.5.15` and `bpy==5.0.1` as well.) Without `bpy` nothing is tested, and it says so. `--keep DIR` leaves the archives there,
with `expected.json`: what a reader has to find in them.

Hair is made in Blender, exported, and read twice: by the reader below, which shares no code with the writer, and
by Blender's own importer. What Blender's own exporter writes of the same hair is compared too.
"""

import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
# The preferences that an add-on is installed in.
os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="keratin_blender_"))
try:
    import bpy
except ImportError as missing:
    print(f"skipped: {missing}; `pip install bpy==4.2.23` with Python 3.11, then run this file again")
    sys.exit(0)
import numpy as np
from mathutils import Euler, Matrix, Quaternion, Vector

sys.path.insert(0, str(HERE))
import keratin_export as addon  # noqa: E402

KEEP = None
EXPECTED = {}
NEAR = 1e-5


# ---------------------------------------------------------------- a reader of its own

class Ogawa:
    """First samples of curve sets. Layout: five parts of the root, objects and properties by headers."""

    def __init__(self, path):
        self.b = Path(path).read_bytes()
        assert self.b[:8] == b"Ogawa\xff\0\x01", self.b[:8]
        root = self.group(self.u64(8))
        assert len(root) == 6
        shared, at, self.metadata = self.data(root[5]), 0, [""]
        while at < len(shared):
            self.metadata.append(shared[at + 1:at + 1 + shared[at]].decode())
            at += 1 + shared[at]
        self.sets = {}
        self.walk(root[2], "", np.eye(4))

    def u64(self, at):
        return struct.unpack_from("<Q", self.b, at)[0]

    def group(self, at):
        return [] if at == 0 else [self.u64(at + 8 + 8 * k) for k in range(self.u64(at))]

    def data(self, child):
        assert child >> 63, "not data"
        at = child & ~(1 << 63)
        if at == 0:
            return b""
        size = self.u64(at)
        assert at + 8 + size <= len(self.b)
        return self.b[at + 8:at + 8 + size]

    def properties(self, at):
        group, found, k = self.group(at), {}, 0
        headers = self.data(group[-1]) if group else b""
        p = 0
        while p < len(headers):
            info, = struct.unpack_from("<I", headers, p)
            width = 1 << min(info >> 2 & 3, 2)
            p += 4

            def number():
                nonlocal p
                p += width
                return int.from_bytes(headers[p - width:p], "little")

            samples = number() if info & 3 else 0
            for _ in range(2 * (info >> 9 & 1) + (info >> 8 & 1)):
                number()
            size = number()
            name = headers[p:p + size].decode()
            p += size
            meta = info >> 20 & 255
            if meta == 255:
                size = number()
                text = headers[p:p + size].decode()
                p += size
            else:
                text = self.metadata[meta]
            found[name] = (info, samples, text, group[k])
            k += 1
        return found

    def value(self, found):
        """An array of elements, or text."""
        info, samples, _, at = found
        if not info & 3 or not samples:
            return None
        content = self.data(self.group(at)[0])[16:]
        kind = [None, "u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8", "text"][info >> 4 & 15]
        if kind == "text":
            return content.decode()
        values = np.frombuffer(content, kind or "u1")
        extent = info >> 12 & 255
        return values.reshape(-1, extent) if extent > 1 else values

    def walk(self, at, path, matrix):
        group = self.group(at)
        headers, p, k = self.data(group[-1])[:-32] if group and group[-1] >> 63 else b"", 0, 0
        while p < len(headers):
            size, = struct.unpack_from("<I", headers, p)
            name = headers[p + 4:p + 4 + size].decode()
            p += 4 + size
            meta = headers[p]
            p += 1
            text = self.metadata[meta] if meta < 255 else ""
            if meta == 255:
                size, = struct.unpack_from("<I", headers, p)
                text = headers[p + 4:p + 4 + size].decode()
                p += 4 + size
            child = group[1 + k]
            k += 1
            own = self.properties(self.group(child)[0])
            here = matrix
            if ".xform" in own:
                inside = self.properties(own[".xform"][3])
                if ".vals" in inside:  # as Blender writes it: one matrix
                    assert self.value(inside[".ops"]).tolist() == [48]
                    here = self.value(inside[".vals"]).reshape(4, 4) @ matrix
            if "AbcGeom_Curve_v2" in text and "nVertices" in (geom := self.properties(own[".geom"][3])):
                more = self.properties(geom[".arbGeomParams"][3]) if ".arbGeomParams" in geom else {}
                values = {key: self.value(v) for key, v in [*geom.items(), *more.items()]}
                scopes = {key: dict(e.split("=", 1) for e in v[2].split(";") if e).get("geoScope")
                          for key, v in [*geom.items(), *more.items()]}
                p4 = np.c_[values["P"].astype(np.float64), np.ones(len(values["P"]))] @ here
                values |= {"P": p4[:, :3], "scopes": scopes}
                self.sets[f"{path}/{name}"] = values
            self.walk(child, f"{path}/{name}", here)


def y_up(points):
    points = np.asarray(points, np.float64)
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], 1)


# ---------------------------------------------------------------- hair, made here

def scene(unit=1.0):
    """An empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.unit_settings.scale_length = unit


def linked(obj, parent=None, place=None):
    bpy.context.scene.collection.objects.link(obj)
    obj.parent = parent
    if place is not None:
        obj.location, obj.rotation_euler, obj.scale = place
    return obj


def head(name="Head", place=None, uvs=True, parent=None):
    """A ball of 10 cm, its middle 12 cm up, with UVs by longitude and height."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=16, radius=0.1, location=(0, 0, 0.12))
    obj = bpy.context.active_object
    bpy.ops.object.transform_apply()
    obj.name = name
    if not uvs:
        obj.data.uv_layers.remove(obj.data.uv_layers[0])
    else:
        layer = obj.data.uv_layers[0].data
        for loop in obj.data.loops:  # affine in each quad, so that UVs between corners are known
            at = obj.data.vertices[loop.vertex_index].co
            layer[loop.index].uv = (0.5 + at.x, at.z)
    obj.parent = parent
    if place is not None:
        obj.location, obj.rotation_euler, obj.scale = place
    bpy.context.view_layer.update()
    return obj


def strands_of(count=20, most=9, seed=1):
    """Strands of 2 and more points that leave a ball's upper half and fall."""
    rng = np.random.default_rng(seed)
    strands = []
    for k in range(count):
        way = rng.normal(size=3)
        way[2] = abs(way[2])
        way /= np.linalg.norm(way)
        root = np.array([0, 0, 0.12]) + 0.1 * way
        nodes = 2 + k % (most - 1)
        t = np.linspace(0, 1, nodes)[:, None]
        fall = 0.2 * t * t * np.array([0, 0, 1])
        strands.append(root + 0.15 * t * way - fall + rng.normal(size=(nodes, 3)) * 1e-3 * t)
    return strands


def hair_curves(name, strands, surface=None, parent=None, place=None, radius=True, uvs=True):
    data = bpy.data.hair_curves.new(name)
    obj = linked(bpy.data.objects.new(name, data), parent, place)
    if strands:
        data.add_curves([len(s) for s in strands])
        flat = np.concatenate(strands).astype(np.float32)
        data.attributes["position"].data.foreach_set("vector", flat.ravel())
        if radius:
            radii = np.concatenate([np.linspace(4e-5, 2e-5, len(s)) for s in strands]).astype(np.float32)
            add(data, "radius", "FLOAT", "POINT", "value", radii)
    if surface is not None:
        data.surface = surface
        data.surface_uv_map = surface.data.uv_layers[0].name if surface.data.uv_layers else ""
        if uvs and strands:
            st = np.array([(0.5 + s[0][0], s[0][2]) for s in strands], np.float32)
            add(data, "surface_uv_coordinate", "FLOAT2", "CURVE", "vector", st.ravel())
    bpy.context.view_layer.update()
    return obj


def add(data, name, kind, domain, key, values):
    attribute = data.attributes.get(name) or data.attributes.new(name, kind, domain)
    attribute.data.foreach_set(key, values)
    data.update_tag()
    bpy.context.view_layer.update()


def material_of(name, color):
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
    return material


def particle_hair(surface, count=30, children=4, name="Hair", diameter=8e-5):
    modifier = surface.modifiers.new(name, "PARTICLE_SYSTEM")
    s = modifier.particle_system.settings
    s.type, s.count, s.hair_length, s.hair_step = "HAIR", count, 0.12, 5
    s.display_step, s.render_step = 2, 3
    s.brownian_factor = 0.02
    if children:
        s.child_type, s.child_percent, s.rendered_child_count = "INTERPOLATED", 1, children
        s.clump_factor, s.roughness_2 = 0.3, 0.005
    if diameter:
        s.root_radius, s.tip_radius, s.radius_scale, s.use_close_tip = 1.0, 0.5, diameter, False
    bpy.context.view_layer.update()
    return modifier.particle_system


def select(*objects):
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0] if objects else None


class Test(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        scene()
        addon.register()

    def tearDown(self):
        addon.unregister()

    def export(self, name, *objects, **options):
        """Exports by the add-on, through its operator; remembers what readers should find."""
        select(*objects)
        folder = Path(KEEP or tempfile.mkdtemp())
        path = folder / f"{name}.abc"
        self.assertEqual(bpy.ops.export_scene.bevy_keratin(filepath=str(path), **options), {"FINISHED"})
        self.path = path
        archive = Ogawa(path)
        EXPECTED[path.name] = {"objects": [self.numbers(key, s) for key, s in archive.sets.items()]}
        return archive.sets

    def numbers(self, key, s):
        p, at = s["P"], np.cumsum(np.r_[0, s["nVertices"]])
        total = sum(float(np.linalg.norm(np.diff(p[a:b], axis=0), axis=1).sum()) for a, b in zip(at[:-1], at[1:]))
        widths, guides = s.get("width"), s.get("groom_guide")
        return dict(path=key, curves=len(s["nVertices"]), points=len(p), total_polyline_m=total, min=p.min(0).tolist(),
                    max=p.max(0).tolist(), first_point=p[0].tolist(), last_point=p[-1].tolist(),
                    mean_width=None if widths is None else float(widths.mean()),
                    guides=None if guides is None else int(guides.sum()), has_uvs="groom_root_uv" in s,
                    has_colors="groom_color" in s)

    def refused(self, *objects, **options):
        select(*objects)
        path = Path(tempfile.mkdtemp()) / "no.abc"
        with self.assertRaises(RuntimeError) as caught:
            bpy.ops.export_scene.bevy_keratin(filepath=str(path), **options)
        self.assertFalse(path.exists())
        self.assertEqual(list(path.parent.iterdir()), [])
        return str(caught.exception)

    def notes(self, *objects, **options):
        options = addon.Options(**options)
        found = addon.collect(bpy.context, list(objects), options)
        return found, " | ".join(found.notes)

    def near(self, found, expected, bound=NEAR):
        found, expected = np.asarray(found, np.float64), np.asarray(expected, np.float64)
        self.assertEqual(found.shape, expected.shape)
        off = np.abs(found - expected).max() if found.size else 0.0
        self.assertLess(off, bound)

    def imported(self):
        """What Blender's importer makes of the last file: points in world space, radii, by object."""
        before = set(bpy.data.objects)
        bpy.ops.object.select_all(action="DESELECT")
        bpy.ops.wm.alembic_import(filepath=str(self.path), as_background_job=False)
        bpy.context.view_layer.update()
        found = {}
        for obj in set(bpy.data.objects) - before:
            if obj.type not in ("CURVE", "CURVES"):
                continue
            data = obj.data
            if obj.type == "CURVES":
                offsets = np.empty(len(data.curve_offset_data), np.int32)
                data.curve_offset_data.foreach_get("value", offsets)
                points = np.empty(3 * offsets[-1], np.float32)
                data.position_data.foreach_get("vector", points)
                points, counts = points.reshape(-1, 3), np.diff(offsets)
                radii = None
                if "radius" in data.attributes:
                    radii = np.empty(len(points), np.float32)
                    data.attributes["radius"].data.foreach_get("value", radii)
            else:
                counts = [len(s.points) for s in data.splines]
                points = np.array([tuple(p.co[:3]) for s in data.splines for p in s.points])
                radii = np.array([p.radius for s in data.splines for p in s.points])
            world = np.array([tuple(obj.matrix_world @ Vector(p)) for p in points.tolist()])
            name = obj.name.split(".")[0]
            self.assertNotIn(name, found)
            found[name] = (world, list(counts), radii)
        return found

    def by_blender(self, *objects):
        """What Blender's own exporter writes, of meshes with their subdivision."""
        select(*objects)
        path = Path(tempfile.mkdtemp()) / "own.abc"
        bpy.ops.wm.alembic_export(filepath=str(path), start=1, end=1, selected=True, as_background_job=False,
                                  evaluation_mode="RENDER", apply_subdiv=True)
        return Ogawa(path).sets


class HairCurves(Test):
    place = ((0.3, -0.2, 1.5), (0.4, -0.3, 1.1), (1.5, 1.5, 1.5))

    def world(self, strands, matrix):
        return np.array([tuple(matrix @ Vector(p)) for s in strands for p in s.tolist()])

    def test_strands_widths_and_uvs_of_a_head_at_life_size(self):
        skull, strands = head(), strands_of(60)
        hair = hair_curves("Bob", strands, skull, skull)
        sets = self.export("curves", hair)
        self.assertEqual(list(sets), ["/groom/Head/Bob/Bob"])
        bob = sets["/groom/Head/Bob/Bob"]
        self.near(bob["P"], y_up(np.concatenate(strands)))
        self.assertEqual(bob["nVertices"].tolist(), [len(s) for s in strands])
        self.near(bob["width"], np.concatenate([np.linspace(8e-5, 4e-5, len(s)) for s in strands]), 1e-10)
        self.near(bob["groom_root_uv"], [(0.5 + s[0][0], s[0][2]) for s in strands], 1e-6)
        self.assertEqual(bob["curveBasisAndType"].tolist(), [[1, 0, 0, 0]])
        self.assertEqual((bob["groom_group_name"], bob["groom_group_id"].tolist()), ("Bob\0", [0]))
        self.assertEqual({k: bob["scopes"][k] for k in ("width", "groom_root_uv", "groom_group_id")},
                         {"width": "vtx", "groom_root_uv": "uni", "groom_group_id": "con"})
        self.assertNotIn("groom_guide", bob)
        # Upright: roots are above the middle of the head, 12 cm up; tips hang below the roots' top.
        roots = bob["P"][np.cumsum(bob["nVertices"]) - bob["nVertices"]]
        self.assertTrue((roots[:, 1] > 0.1199).all() and roots[:, 1].max() < 0.2201)
        self.near(np.linalg.norm(roots - [0, 0.12, 0], axis=1), np.full(60, 0.1))
        self.near(bob[".selfBnds"].ravel(), [*bob["P"].min(0), *bob["P"].max(0)], 1e-6)
        world, counts, radii = self.imported()["Bob"]
        self.near(world, np.concatenate(strands))
        self.assertEqual(counts, [len(s) for s in strands])
        self.near(2 * radii, bob["width"], 1e-9)

    def test_transforms_of_the_object_and_its_parents_are_applied(self):
        strands = strands_of(25, seed=2)
        root = linked(bpy.data.objects.new("Root", None), None, ((0, 0, 1), (0, 0, 0.7), (0.5, 0.5, 0.5)))
        skull = head(parent=root, place=((0.1, 0, 0), (0.2, 0, 0), (1, 1, 1)))
        hair = hair_curves("Bob", strands, skull, skull, self.place)
        matrix = Matrix.LocRotScale(Vector((0, 0, 1)), Euler((0, 0, 0.7)), Vector((0.5,) * 3)) \
            @ Matrix.LocRotScale(Vector((0.1, 0, 0)), Euler((0.2, 0, 0)), None) \
            @ Matrix.LocRotScale(Vector(self.place[0]), Euler(self.place[1]), Vector(self.place[2]))
        bob = self.export("placed", hair)["/groom/Head/Bob/Bob"]
        self.near(bob["P"], y_up(self.world(strands, matrix)))
        self.near(bob["width"], 0.75 * np.concatenate([np.linspace(8e-5, 4e-5, len(s)) for s in strands]), 1e-9)
        world, counts, radii = self.imported()["Bob"]
        self.near(world, self.world(strands, matrix))
        self.assertEqual(counts, [len(s) for s in strands])
        self.near(2 * radii, bob["width"], 1e-9)
        own, = self.by_blender(hair).values()
        self.near(bob["P"], own["P"])
        self.assertEqual(bob["nVertices"].tolist(), own["nVertices"].tolist())

    def test_uneven_and_mirrored_scales(self):
        strands = strands_of(9)
        hair = hair_curves("Bob", strands, place=((0, 0, 0), (0.3, 0, 0), (-2, 1, 0.5)))
        bob = self.export("mirrored", hair)["/groom/Bob/Bob"]
        matrix = Matrix.LocRotScale(None, Euler((0.3, 0, 0)), Vector((-2, 1, 0.5)))
        self.near(bob["P"], y_up(self.world(strands, matrix)))
        self.near(bob["width"], np.concatenate([np.linspace(8e-5, 4e-5, len(s)) for s in strands]), 1e-9)

    def test_modifiers_are_applied_or_not(self):
        strands = strands_of(12)
        hair = hair_curves("Bob", strands)
        tree = bpy.data.node_groups.new("Lift", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
        resample, lift = tree.nodes.new("GeometryNodeResampleCurve"), tree.nodes.new("GeometryNodeSetPosition")
        resample.inputs["Count"].default_value = 7
        lift.inputs["Offset"].default_value = (0, 0, 0.5)
        tree.links.new(start.outputs[0], resample.inputs[0])
        tree.links.new(resample.outputs[0], lift.inputs[0])
        tree.links.new(lift.outputs[0], end.inputs[0])
        hair.modifiers.new("Lift", "NODES").node_group = tree
        bpy.context.view_layer.update()
        for node in ("GeometryNodeGeometryToInstance", "GeometryNodeCurveToMesh"):
            made = tree.nodes.new(node)
            tree.links.new(lift.outputs[0], made.inputs[0])
            tree.links.new(made.outputs[0], end.inputs[0])
            bpy.context.view_layer.update()
            self.assertIn("Bob: it has no strands: its modifiers leave instances", self.refused(hair))
        tree.links.new(lift.outputs[0], end.inputs[0])
        bpy.context.view_layer.update()
        bob = self.export("modified", hair)["/groom/Bob/Bob"]
        self.assertEqual(bob["nVertices"].tolist(), [7] * 12)
        roots = np.array([s[0] for s in strands])
        self.near(bob["P"][::7], y_up(roots + [0, 0, 0.5]))
        self.near(self.export("original", hair, original=True)["/groom/Bob/Bob"]["P"], y_up(np.concatenate(strands)))

    def test_hair_by_blenders_own_nodes_is_what_blender_writes(self):
        found = [f for f in Path(bpy.utils.resource_path("LOCAL")).rglob("procedural_hair_node_assets.blend")]
        if not found:
            self.skipTest("this Blender comes without its hair nodes")
        skull = head()
        hair = hair_curves("Bob", strands_of(40), skull, skull)
        wanted = ["Interpolate Hair Curves", "Clump Hair Curves", "Frizz Hair Curves", "Set Hair Curve Profile"]
        with bpy.data.libraries.load(str(found[0])) as (_, into):
            into.node_groups = list(wanted)
        for name in wanted:
            modifier = hair.modifiers.new(name, "NODES")
            modifier.node_group = bpy.data.node_groups[name]
            for item in modifier.node_group.interface.items_tree:
                if item.item_type == "SOCKET" and item.in_out == "INPUT":
                    if item.name == "Surface" and item.socket_type == "NodeSocketObject":
                        modifier[item.identifier] = skull
                    elif item.name == "Density":
                        modifier[item.identifier] = 20_000.0
        hair.data.update_tag()
        bpy.context.view_layer.update()
        bob = self.export("nodes", hair)["/groom/Head/Bob/Bob"]
        own, = self.by_blender(hair).values()
        self.assertGreater(len(bob["nVertices"]), 1000)
        self.assertEqual(bob["nVertices"].tolist(), own["nVertices"].tolist())
        self.near(bob["P"], own["P"])
        self.near(bob["width"], own["width"], 1e-7)
        self.assertEqual(bob["groom_root_uv"].shape, (len(bob["nVertices"]), 2))
        self.assertIn("mm thick, hair is 0.05 to 0.1 mm", self.notes(hair)[1])

    def test_the_gltf_of_the_same_head_is_in_the_same_place(self):
        root = linked(bpy.data.objects.new("Root", None), None, ((0, 0, 1), (0, 0, 0.7), (0.5, 0.5, 0.5)))
        skull, strands = head(parent=root, place=((0.1, 0, 0), (0.2, 0, 0), (1, 1, 1))), strands_of(30)
        hair = hair_curves("Bob", strands, skull, skull, uvs=False)
        bob = self.export("beside-gltf", hair)["/groom/Head/Bob/Bob"]
        select(root, skull)
        path = Path(tempfile.mkdtemp()) / "head.glb"
        bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True)
        blob = path.read_bytes()
        size, = struct.unpack_from("<I", blob, 12)
        gltf, data = json.loads(blob[20:20 + size]), blob[28 + size:]

        def values(accessor, kind, extent):
            accessor = gltf["accessors"][accessor]
            view = gltf["bufferViews"][accessor["bufferView"]]
            start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            return np.frombuffer(data, kind, accessor["count"] * extent, start).reshape(-1, extent)

        def place(node):
            x, y, z, w = node.get("rotation", (0, 0, 0, 1))
            turned = Matrix.LocRotScale(Vector(node.get("translation", (0, 0, 0))), Quaternion((w, x, y, z)),
                                        Vector(node.get("scale", (1, 1, 1))))
            return np.array(turned)

        nodes = gltf["nodes"]
        skin, = (n for n in nodes if n["name"] == "Head")
        above, = (n for n in nodes if n["name"] == "Root")
        matrix = place(above) @ place(skin)
        attributes = gltf["meshes"][skin["mesh"]]["primitives"][0]["attributes"]
        points = values(attributes["POSITION"], "<f4", 3) @ matrix[:3, :3].T + matrix[:3, 3]
        middle = (points.max(0) + points.min(0)) / 2
        self.near(np.linalg.norm(points - middle, axis=1), np.full(len(points), 0.05))
        roots = bob["P"][np.cumsum(bob["nVertices"]) - bob["nVertices"]]
        self.near(np.linalg.norm(roots - middle, axis=1), np.full(30, 0.05))
        # UVs are those of the nearest corners, but for V, which glTF counts from the top.
        st = values(attributes["TEXCOORD_0"], "<f4", 2)
        nearest = np.linalg.norm(roots[:, None] - points, axis=2).argmin(1)
        self.near(bob["groom_root_uv"] * [1, -1] + [0, 1], st[nearest], 0.03)

    def test_the_unit_of_the_scene(self):
        scene(0.01)
        strands = [s * 100 for s in strands_of(10)]
        hair = hair_curves("Bob", strands)
        add(hair.data, "radius", "FLOAT", "POINT", "value", np.full(sum(map(len, strands)), 4e-3, np.float32))
        bob = self.export("centimetres", hair)["/groom/Bob/Bob"]
        self.near(bob["P"], y_up(np.concatenate(strands_of(10))))
        self.near(bob["width"], np.full(len(bob["P"]), 8e-5), 1e-9)
        _, notes = self.notes(hair, unit_scale=False)
        self.assertRegex(notes, r"Bob: strands are 8 mm thick.* \| The hair is [0-9.]+ m large: check the scene's unit")

    def test_uvs_come_from_the_nearest_place_of_the_surface(self):
        place = ((1, 2, 3), (0.5, 0.1, 0.2), (2, 2, 2))
        skull, strands = head(place=place), strands_of(40)
        hair = hair_curves("Bob", strands, skull, skull, uvs=False)
        bob = self.export("nearest", hair)["/groom/Head/Bob/Bob"]
        # Roots lie outside of the flat faces, by 2 mm at most.
        self.near(bob["groom_root_uv"], [(0.5 + s[0][0], s[0][2]) for s in strands], 3e-3)

    def test_without_widths_and_surface_there_are_none_and_it_says_so(self):
        hair = hair_curves("Bob", strands_of(4), radius=False)
        found, notes = self.notes(hair)
        self.assertIsNone(found.sets[0].widths)
        self.assertIn("Bob: no attribute “radius”, so no widths are written", notes)
        self.assertIn("nor a surface with UVs", notes)
        sets = self.export("bare", hair)
        self.assertFalse({"width", "groom_root_uv", "groom_color", "groom_guide"} & set(sets["/groom/Bob/Bob"]))

    def test_colours_of_points_of_strands_and_of_materials(self):
        strands = strands_of(5)
        count = sum(map(len, strands))
        points = hair_curves("Points", strands)
        rgba = np.linspace(0, 1, 4 * count, dtype=np.float32)
        add(points.data, "tint", "FLOAT_COLOR", "POINT", "color", rgba)
        each = hair_curves("Strands", strands)
        byte = np.tile(np.array([1, 0, 0.2, 1], np.float32), 5)
        add(each.data, "tint", "BYTE_COLOR", "CURVE", "color", byte)
        plain = hair_curves("Material", strands)
        material = material_of("Red", (0.4, 0.1, 0.05, 1))
        plain.data.materials.append(material)
        two = hair_curves("Two", strands)
        other = material_of("Blue", (0, 0, 1, 1))
        two.data.materials.append(material)
        two.data.materials.append(other)
        add(two.data, "material_index", "INT", "CURVE", "value", np.array([0, 1, 0, 1, 1], np.int32))
        bare = hair_curves("Bare", strands)
        sets = self.export("colours", points, each, plain, two, bare)
        colors = {key.split("/")[-1]: s.get("groom_color") for key, s in sets.items()}
        self.near(colors["Points"], rgba.reshape(-1, 4)[:, :3], 1e-6)
        self.near(colors["Strands"], np.tile([1, 0, 0.2], (5, 1)), 5e-3)
        self.near(colors["Material"], [(0.4, 0.1, 0.05)], 1e-6)
        self.near(colors["Two"][[0, 1]], [(0.4, 0.1, 0.05), (0, 0, 1)], 1e-6)
        self.assertIsNone(colors["Bare"])
        scopes = [sets[f"/groom/{n}/{n}"]["scopes"]["groom_color"] for n in ("Points", "Strands", "Material", "Two")]
        self.assertEqual(scopes, ["vtx", "uni", "con", "uni"])
        hair = material.node_tree.nodes.new("ShaderNodeBsdfHairPrincipled")
        hair.parametrization = "MELANIN"
        material.node_tree.nodes.remove(material.node_tree.nodes["Principled BSDF"])
        found, notes = self.notes(plain)
        self.assertIsNone(found.sets[0].colors)
        self.assertIn("Material: material Red: its colour is melanin", notes)
        hair.parametrization = "COLOR"
        hair.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1)
        self.near(self.notes(plain)[0].sets[0].colors, [(0.1, 0.2, 0.3)], 1e-6)
        self.assertTrue(all(s.colors is None for s in self.notes(points, plain, colors=False)[0].sets))

    def test_guides(self):
        skull = head()
        guides = hair_curves("Hair Guides", strands_of(8, seed=3), skull)
        hair = hair_curves("Hair", strands_of(100), skull)
        sets = self.export("guides", guides, hair)
        self.assertEqual(sets["/groom/Head/Hair Guides/Hair Guides"]["groom_guide"].tolist(), [1] * 8)
        self.assertEqual(sets["/groom/Head/Hair/Hair"]["groom_guide"].tolist(), [0] * 100)
        self.assertEqual(sets["/groom/Head/Hair/Hair"]["scopes"]["groom_guide"], "uni")
        spread = self.export("farthest", hair, guides="FARTHEST", every=10)["/groom/Head/Hair/Hair"]
        chosen = np.flatnonzero(spread["groom_guide"])
        self.assertEqual(len(chosen), 10)
        roots = spread["P"][np.cumsum(spread["nVertices"]) - spread["nVertices"]]
        apart = np.linalg.norm(roots[chosen][:, None] - roots[chosen], axis=2)[np.triu_indices(10, 1)].min()
        rng = np.random.default_rng(0)
        for _ in range(20):  # spread further than any picked at random
            some = roots[rng.choice(100, 10, replace=False)]
            self.assertLess(np.linalg.norm(some[:, None] - some, axis=2)[np.triu_indices(10, 1)].min(), apart)
        # Over all sets together.
        found, _ = self.notes(guides, hair, guides="FARTHEST", every=9)
        self.assertEqual(found.guides, 12)
        self.assertEqual(self.notes(guides, hair, guides="ALL")[0].guides, 108)
        self.assertTrue(all(s.guides is None for s in self.notes(guides, hair, guides="NONE")[0].sets))
        add(hair.data, "groom_guide", "BOOLEAN", "CURVE", "value", np.arange(100) % 4 == 0)
        add(hair.data, "groom_group_id", "INT", "CURVE", "value", np.arange(100, dtype=np.int32) % 3)
        marked = self.export("marked", hair)["/groom/Head/Hair/Hair"]
        self.assertEqual(marked["groom_guide"].tolist(), [int(i % 4 == 0) for i in range(100)])
        self.assertEqual(marked["groom_group_id"].tolist(), [i % 3 for i in range(100)])

    def test_stiffness_and_damping_of_strands(self):
        hair = hair_curves("Hair", strands_of(100), head())
        plain = self.export("plain", hair)["/groom/Head/Hair/Hair"]
        self.assertNotIn("groom_stiffness", plain)
        self.assertNotIn("groom_damping", plain)
        shares = np.linspace(0.5, 2.0, 100).astype(np.float32)
        add(hair.data, "groom_stiffness", "FLOAT", "CURVE", "value", shares)
        written = self.export("stiff", hair)["/groom/Head/Hair/Hair"]
        self.near(written["groom_stiffness"], shares, 1e-6)
        self.assertEqual(written["scopes"]["groom_stiffness"], "uni")
        add(hair.data, "groom_damping", "FLOAT", "CURVE", "value", 2.0 - shares)
        written = self.export("damped", hair)["/groom/Head/Hair/Hair"]
        self.near(written["groom_damping"], 2.0 - shares, 1e-6)
        self.near(written["groom_stiffness"], shares, 1e-6)
        shares[:3] = -1.0, np.nan, 1e9
        add(hair.data, "groom_stiffness", "FLOAT", "CURVE", "value", shares)
        found, notes = self.notes(hair)
        self.near(found.sets[0].shares["groom_stiffness"][:4], [0.01, 1.0, 100.0, shares[3]], 1e-6)
        self.assertIn("3 values of groom_stiffness", notes)

    def test_several_heads_and_names_that_no_path_can_hold(self):
        a, b = head("A/B"), head("Other")
        hairs = [hair_curves("x/y", strands_of(3), a), hair_curves("free", strands_of(4)),
                 hair_curves("x_y", strands_of(5), a), hair_curves("Hair", strands_of(6), b)]
        sets = self.export("names", *hairs)
        self.assertEqual({k: len(s["nVertices"]) for k, s in sets.items()},
                         {"/groom/free/free": 4, "/groom/Other/Hair/Hair": 6, "/groom/A_B/x_y/x_y": 3,
                          "/groom/A_B/x_y_2/x_y_2": 5})
        ids = sorted(s["groom_group_id"].tolist()[0] for s in sets.values())
        self.assertEqual(ids, [0, 1, 2, 3])

    def test_bezier_curves_keep_their_anchors_and_nurbs_are_refused(self):
        anchors = np.array([(0, 0, 0), (0, 0, 0.1), (0.1, 0, 0.1)], np.float32)
        for kind in ("BEZIER", "NURBS"):
            old = bpy.data.curves.new(kind, "CURVE")
            old.dimensions = "3D"
            spline = old.splines.new(kind)
            if kind == "BEZIER":
                spline.bezier_points.add(2)
                for point, at in zip(spline.bezier_points, anchors):
                    point.handle_left_type = point.handle_right_type = "FREE"
                    point.co, point.handle_left, point.handle_right = at, at - [0, 0.01, 0], at + [0, 0.01, 0]
            else:
                spline.points.add(2)
                for point, at in zip(spline.points, anchors):
                    point.co = (*at, 1)
            obj = linked(bpy.data.objects.new(kind, old))
            select(obj)
            bpy.ops.object.convert(target="CURVES")
            obj = bpy.context.active_object
            if kind == "NURBS":
                self.assertIn("1 of its curves are NURBS", self.refused(obj))
                continue
            found = self.export("bezier", obj)["/groom/BEZIER/BEZIER"]
            self.assertEqual(found["nVertices"].tolist(), [7])
            self.near(found["P"][::3], y_up(anchors))
            # A third of the way, by Bernstein's polynomials: (8 a + 12 b + 6 c + d) / 27.
            a, b = anchors[0], anchors[1]
            third = (8 * a + 12 * (a + [0, 0.01, 0]) + 6 * (b - [0, 0.01, 0]) + b) / 27
            self.near(found["P"][1:2], y_up([third]))

    def test_errors_say_what_to_do(self):
        skull = head()
        lamp = linked(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
        hair = hair_curves("Bob", strands_of(5), skull, skull)
        self.assertIn("Nothing is selected: select hair curves", self.refused())
        self.assertIn("There is no hair on Lamp (light): hair curves", self.refused(lamp))
        self.assertIn("There is no hair on Head (mesh): select Bob, which grows on it", self.refused(skull))
        empty = hair_curves("Empty", [])
        self.assertIn("Empty: it has no strands", self.refused(empty))
        self.assertEqual(self.notes(empty, hair)[0].strands, 5)
        hair.scale = (1, 0, 1)
        bpy.context.view_layer.update()
        self.assertIn("Bob: it, or what it is parented to, is scaled to 0", self.refused(hair))
        hair.scale = (1, 1, 1)
        skull.scale = (0, 0, 0)
        bpy.context.view_layer.update()
        self.assertIn("scaled to 0", self.refused(hair))
        skull.scale = (1, 1, 1)
        bpy.context.view_layer.update()
        with self.assertRaisesRegex(addon.Refused, "cannot be written: No such file"):
            addon.export(bpy.context, "/no/such/folder/bob.abc", [hair], addon.Options())

    def test_strands_that_cannot_be_read_are_left_out_and_counted(self):
        strands = strands_of(6)
        point, still = np.array([[0, 0, 0.22]]), np.array([[0.01, 0, 0.22]] * 3)
        nan = np.array([[0, 0.02, 0.2], [np.nan, 0, 0], [0, 0, 0.4]])
        mixed = [strands[0], point, strands[1], nan, *strands[2:5], still, point, strands[5]]
        hair = hair_curves("Bob", mixed)
        found, notes = self.notes(hair)
        self.assertIn("Bob: 2 strands of one point or none are left out, the first is number 1", notes)
        self.assertIn("Bob: 1 strands with a number that is not finite are left out, the first is number 3", notes)
        self.assertIn("Bob: 1 strands without length are left out, the first is number 7", notes)
        bob = self.export("cleaned", hair)["/groom/Bob/Bob"]
        self.near(bob["P"], y_up(np.concatenate(strands)))
        self.near(bob["width"], np.concatenate([np.linspace(8e-5, 4e-5, len(s)) for s in strands]), 1e-10)
        only = hair_curves("Only", [point, nan])
        self.assertIn("No strand is left to export. Only: ", self.refused(only))
        minus = hair_curves("Minus", strands)
        add(minus.data, "radius", "FLOAT", "POINT", "value", np.full(sum(map(len, strands)), -1, np.float32))
        self.assertIn("negative widths are written as 0", self.notes(minus)[1])

    def test_many_strands(self):
        rng = np.random.default_rng(5)
        roots = rng.normal(size=(20_000, 1, 3))
        roots = roots / np.linalg.norm(roots, axis=2, keepdims=True) * 0.1
        flat = roots * (1 + np.linspace(0, 1, 16)[None, :, None])
        hair = hair_curves("Much", list(flat))
        much = self.export("many", hair, guides="FARTHEST", every=100)["/groom/Much/Much"]
        self.near(much["P"], y_up(flat.reshape(-1, 3)))
        self.assertEqual(int(much["groom_guide"].sum()), 200)


class ParticleHair(Test):
    def test_children_are_what_blender_writes_and_parents_are_their_guides(self):
        skull = head()
        particle_hair(skull)
        hair = self.export("particles", skull)["/groom/Head/Hair/Hair"]
        own, = self.by_blender(skull).values()  # the children only, with the steps of renders
        self.assertEqual(len(own["nVertices"]), 120)
        self.assertEqual(hair["nVertices"].tolist(), [9] * 150)
        self.near(hair["P"][9 * 30:], own["P"])
        self.near(hair["groom_root_uv"][30:], own["uv"], 1e-5)
        self.assertEqual(hair["groom_guide"].tolist(), [1] * 30 + [0] * 120)
        self.near(hair["width"], np.tile(np.linspace(8e-5, 4e-5, 9), 150), 1e-9)
        # Parents grow on the ball.
        roots = hair["P"][:9 * 30:9]
        self.assertLess(np.abs(np.linalg.norm(roots - [0, 0.12, 0], axis=1) - 0.1).max(), 2.5e-3)
        self.near(hair["groom_root_uv"][:30], np.c_[0.5 + roots[:, 0], roots[:, 1]], 1e-3)
        world, counts, radii = self.imported()["Hair"]
        self.near(y_up(world), hair["P"])
        self.assertEqual(counts, hair["nVertices"].tolist())

    def test_simple_children_on_a_mesh_with_modifiers(self):
        skull = head()
        subdivision = skull.modifiers.new("Subdivision", "SUBSURF")
        subdivision.levels = subdivision.render_levels = 1
        system = particle_hair(skull, 20, 5)
        system.settings.child_type = "SIMPLE"
        system.settings.kink = "CURL"
        bpy.context.view_layer.update()
        for emit_from in ("FACE", "VERT"):
            system.settings.emit_from = emit_from
            bpy.context.view_layer.update()
            hair = self.export(f"simple-{emit_from.lower()}", skull)["/groom/Head/Hair/Hair"]
            own, = self.by_blender(skull).values()
            self.assertEqual(len(hair["nVertices"]), 120)
            self.near(hair["P"][-len(own["P"]):], own["P"])
            evaluated = skull.evaluated_get(bpy.context.evaluated_depsgraph_get())
            for x, y, z in hair["P"][:20 * 9:9]:  # parents grow on what the modifiers make
                _, at, _, _ = evaluated.closest_point_on_mesh((x, -z, y))
                self.near(tuple(at), (x, -z, y))

    def test_without_guides_there_are_only_the_children(self):
        skull = head()
        system = particle_hair(skull)
        hair = self.export("children", skull, guides="NONE")["/groom/Head/Hair/Hair"]
        own, = self.by_blender(skull).values()
        self.near(hair["P"], own["P"])
        self.assertNotIn("groom_guide", hair)
        # Settings of the viewport are as they were.
        s = system.settings
        self.assertEqual((s.display_step, s.child_percent, s.render_step), (2, 1, 3))
        small = self.export("viewport", skull, guides="NONE", as_rendered=False)["/groom/Head/Hair/Hair"]
        self.assertEqual(small["nVertices"].tolist(), [5] * 30)

    def test_moved_turned_and_scaled(self):
        root = linked(bpy.data.objects.new("Root", None), None, ((0, 0, 1), (0, 0, 0.7), (0.5, 0.5, 0.5)))
        skull = head(parent=root, place=((0.3, -0.2, 0.5), (0.4, -0.3, 1.1), (1.5, 1.5, 1.5)))
        particle_hair(skull, 12, 0)
        hair = self.export("particles-placed", skull)["/groom/Head/Hair/Hair"]
        own, = self.by_blender(skull).values()
        self.near(hair["P"], own["P"])
        self.near(hair["groom_root_uv"], own["uv"])
        self.assertNotIn("groom_guide", hair)
        roots = hair["P"][::9]
        middle = y_up([tuple(skull.matrix_world @ Vector((0, 0, 0.12)))])
        self.assertLess(np.abs(np.linalg.norm(roots - middle, axis=1) - 0.075).max(), 2e-3)

    def test_several_systems_shapes_and_what_is_left_out(self):
        skull = head(uvs=False)
        particle_hair(skull, 10, 0, "Bob")
        beard = particle_hair(skull, 5, 0, "Guides", diameter=None)
        off = particle_hair(skull, 5, 0, "Off")
        skull.modifiers["Off"].show_viewport = skull.modifiers["Off"].show_render = False
        found, notes = self.notes(skull)
        self.assertEqual([(s.name, len(s.counts)) for s in found.sets], [("Bob", 10), ("Guides", 5)])
        self.assertIn("Head, Off: its modifier is off, so it is left out", notes)
        self.assertIn("Head, Guides: its diameter is Blender's default of 10 mm", notes)
        self.assertIn("Head, Bob: the mesh has no UVs, so none are written", notes)
        self.assertIsNone(found.sets[1].widths)
        self.assertEqual(found.guides, 5)
        beard.settings.render_type = "OBJECT"
        self.assertIn("it is rendered as object, not as path", self.notes(skull)[1])
        settings = off.settings
        for shape, middle in ((0.0, 0.75), (-0.5, 0.5 + 0.5 * 0.5**0.5), (0.5, 0.5 + 0.5 * 0.5**2)):
            settings.shape = shape
            self.near(addon.diameter(settings, np.array([0, 0.5, 1.0])), [8e-5, 8e-5 * middle, 4e-5], 1e-9)
        settings.use_close_tip = True
        self.assertEqual(addon.diameter(settings, np.array([0, 0.5, 1.0]))[2], 0)
        skull.scale = (0, 1, 1)
        bpy.context.view_layer.update()
        self.assertIn("Head: it, or what it is parented to, is scaled to 0", self.refused(skull))

    def test_curves_and_particles_are_one_groom(self):
        skull = head()
        particle_hair(skull, 10, 3, "Beard")
        hair = hair_curves("Bob", strands_of(7), skull, skull)
        material = material_of("Brown", (0.2, 0.1, 0.05, 1))
        skull.data.materials.append(material)
        sets = self.export("both", skull, hair)
        self.assertEqual(sorted(sets), ["/groom/Head/Beard/Beard", "/groom/Head/Bob/Bob"])
        self.near(sets["/groom/Head/Beard/Beard"]["groom_color"], [(0.2, 0.1, 0.05)], 1e-6)
        self.assertEqual(sum(int(s["groom_guide"].sum()) for s in sets.values()), 10)
        found = self.imported()
        self.assertEqual({k: len(v[1]) for k, v in found.items()}, {"Beard": 40, "Bob": 7})
        for name, (world, _, _) in found.items():
            self.near(y_up(world), sets[f"/groom/Head/{name}/{name}"]["P"])


class Around(Test):
    def test_the_command_line(self):
        skull = head()
        hair_curves("Bob", strands_of(20), skull, skull)
        particle_hair(skull, 5, 2)
        folder = Path(tempfile.mkdtemp())
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "head.blend"))

        def run(*arguments):
            done = subprocess.run([sys.executable, str(HERE / "keratin_export.py"), *map(str, arguments)],
                                  capture_output=True, text=True)
            return done.returncode, done.stdout + done.stderr

        out = folder / "hair.abc"
        code, text = run("--blend", folder / "head.blend", "--out", out)
        self.assertEqual(code, 0, text)
        self.assertIn("35 strands, ", text)
        self.assertIn("5 guides in ", text)
        self.assertEqual(sorted(Ogawa(out).sets), ["/groom/Head/Bob/Bob", "/groom/Head/Hair/Hair"])
        code, text = run("--blend", folder / "head.blend", "--out", out, "--objects", "Bob", "--guides", "farthest",
                         "--every", 5)
        self.assertEqual(code, 0, text)
        self.assertEqual(int(Ogawa(out).sets["/groom/Head/Bob/Bob"]["groom_guide"].sum()), 4)
        code, text = run("--blend", folder / "head.blend", "--out", out, "--objects", "Bib")
        self.assertEqual(code, 1)
        self.assertIn("error: No object named Bib; those with hair: ", text)
        code, text = run("--blend", folder / "none.blend", "--out", out)
        self.assertEqual(code, 1)
        self.assertIn("cannot be opened", text)
        # As `blender -b head.blend --python keratin_export.py -- --out hair.abc` calls it.
        out.unlink()
        start = f"import bpy, runpy, sys; bpy.ops.wm.open_mainfile(filepath={str(folder / 'head.blend')!r}); " \
                f"sys.argv = ['blender', '-b', '--', '--out', {str(out)!r}]; " \
                f"runpy.run_path({str(HERE / 'keratin_export.py')!r}, run_name='__main__')"
        done = subprocess.run([sys.executable, "-c", start], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertTrue(out.exists())

    def test_it_installs_as_an_add_on(self):
        addon.unregister()
        entries = []

        class Menu:
            class layout:
                operator = staticmethod(lambda name, text: entries.append((name, text)))

        bpy.ops.preferences.addon_install(filepath=str(HERE / "keratin_export.py"), overwrite=True)
        bpy.ops.preferences.addon_enable(module="keratin_export")
        self.assertIn("keratin_export", bpy.context.preferences.addons)
        self.assertTrue(hasattr(bpy.types, "EXPORT_SCENE_OT_bevy_keratin"))
        # Its line in File > Export.
        for draw in bpy.types.TOPBAR_MT_file_export._dyn_ui_initialize():
            if draw.__module__ == "keratin_export":
                draw(Menu, bpy.context)
        self.assertEqual(entries, [("export_scene.bevy_keratin", "Hair for bevy_keratin (.abc)")])
        hair = hair_curves("Bob", strands_of(5))
        self.assertEqual(len(self.export("installed", hair)["/groom/Bob/Bob"]["nVertices"]), 5)
        bpy.ops.preferences.addon_disable(module="keratin_export")
        self.assertFalse(hasattr(bpy.types, "EXPORT_SCENE_OT_bevy_keratin"))
        addon.register()

    def test_hair_that_is_being_edited(self):
        hair = hair_curves("Bob", strands_of(5))
        select(hair)
        bpy.ops.object.mode_set(mode="SCULPT_CURVES")
        path = Path(tempfile.mkdtemp()) / "sculpted.abc"
        self.assertEqual(bpy.ops.export_scene.bevy_keratin(filepath=str(path)), {"FINISHED"})
        self.assertEqual(len(Ogawa(path).sets["/groom/Bob/Bob"]["nVertices"]), 5)
        skull = head()
        particle_hair(skull, 10, 3)
        select(skull)
        bpy.ops.object.mode_set(mode="PARTICLE_EDIT")
        self.assertEqual(bpy.ops.export_scene.bevy_keratin(filepath=str(path)), {"FINISHED"})
        self.assertEqual(len(Ogawa(path).sets["/groom/Head/Hair/Hair"]["nVertices"]), 40)

    def test_the_same_hair_is_the_same_file(self):
        hair = hair_curves("Bob", strands_of(5))
        self.export("same", hair)
        first = self.path.read_bytes()
        self.export("same", hair)
        self.assertEqual(first, self.path.read_bytes())


if __name__ == "__main__":
    if "--keep" in sys.argv:
        at = sys.argv.index("--keep")
        KEEP = sys.argv[at + 1]
        del sys.argv[at:at + 2]
        Path(KEEP).mkdir(parents=True, exist_ok=True)
    print("Blender", bpy.app.version_string)
    result = unittest.main(exit=False, verbosity=2).result
    if KEEP:
        (Path(KEEP) / "expected.json").write_text(json.dumps(EXPECTED, indent=1))
    sys.stdout.flush()
    sys.stderr.flush()
    # Not sys.exit: Blender as a module may crash while Python takes it down.
    os._exit(0 if result.wasSuccessful() else 1)
