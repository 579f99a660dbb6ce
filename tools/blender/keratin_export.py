# SPDX-License-Identifier: MIT OR Apache-2.0
"""Exports hair from Blender for bevy_keratin: one groom in an Alembic archive (Ogawa).

In Blender 4.2 or later: Preferences > Add-ons > Install from Disk, then
File > Export > Hair for bevy_keratin (.abc).

Without a window:

    blender -b head.blend --python keratin_export.py -- --out hair.abc [--guides farthest --every 10]

or, with the `bpy` package of PyPI:

    python keratin_export.py --blend head.blend --out hair.abc

Strands are polylines in world space, in metres, with Y up: the frame of Blender's glTF of the same scene.
The chapter "From Blender to your game" of the book says what arrives.
"""

bl_info = {
    "name": "Hair for bevy_keratin",
    "author": "The authors of bevy_keratin",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "File > Export > Hair for bevy_keratin (.abc)",
    "description": "Exports hair curves and particle hair as a groom",
    "category": "Import-Export",
}

import argparse
import hashlib
import os
import struct
import sys
from dataclasses import dataclass, field

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from mathutils.geometry import barycentric_transform

# A strand as thick is no hair (m).
THICK = 1e-3
# What a strand's stiffness and damping may be, as shares of the hair's.
SHARES = {"groom_stiffness": (0.01, 100.0), "groom_damping": (0.0, 100.0)}
# Sizes that hair of a character has (m).
SIZES = (5e-3, 4.0)
# What particle systems have before anyone sets it: a centimetre at the root.
UNSET_DIAMETERS = (1.0, 0.0, 0.01)
# Types of hair curves; Catmull-Rom (0) and poly (1) pass through their points.
BEZIER, NURBS = 2, 3


class Refused(Exception):
    """Why there is no file, in words for the artist."""


@dataclass
class Options:
    """How hair is exported."""

    guides: str = "AUTO"  # AUTO, FARTHEST, ALL, NONE
    every: int = 10  # one guide in so many strands, with FARTHEST
    original: bool = False  # hair curves without their modifiers
    as_rendered: bool = True  # particle hair with the steps and children of renders
    colors: bool = True
    unit_scale: bool = True  # apply the scene's unit scale
    scale: float = 1.0


def roots_of(points, counts):
    """First points of strands; what has no points gets zeros."""
    points = np.concatenate([points, np.zeros((1, 3))])
    return points[np.where(counts > 0, np.cumsum(counts) - counts, -1)]


@dataclass
class Hair:
    """One set of strands: a hair object or particle system. Lengths in metres, Y up."""

    name: str
    points: np.ndarray
    counts: np.ndarray
    head: str = ""
    widths: np.ndarray | None = None  # one a point
    uvs: np.ndarray | None = None  # one a strand
    colors: np.ndarray | None = None  # one, one a strand or one a point …
    color_scope: str = "con"  # … as this says: con, uni or vtx
    guides: np.ndarray | None = None  # one a strand
    groups: np.ndarray | None = None  # one a strand
    shares: dict = field(default_factory=dict)  # by attribute, one a strand: shares of the hair's

    @property
    def roots(self):
        return roots_of(self.points, self.counts)

    def kept(self, strands):
        """Only the strands whose flag is set."""
        nodes = np.repeat(strands, self.counts)

        def part(values, flags):
            return None if values is None else values[flags]

        colors = self.colors
        if colors is not None and self.color_scope != "con":
            colors = colors[nodes if self.color_scope == "vtx" else strands]
        return Hair(self.name, self.points[nodes], self.counts[strands], self.head, part(self.widths, nodes),
                    part(self.uvs, strands), colors, self.color_scope, part(self.guides, strands),
                    part(self.groups, strands), {k: v[strands] for k, v in self.shares.items()})


@dataclass
class Exported:
    """What was written, and what the artist should know."""

    sets: list = field(default_factory=list)
    notes: list = field(default_factory=list)

    @property
    def strands(self):
        return sum(len(s.counts) for s in self.sets)

    @property
    def points(self):
        return sum(len(s.points) for s in self.sets)

    @property
    def guides(self):
        return sum(int(s.guides.sum()) for s in self.sets if s.guides is not None)

    def __str__(self):
        guides = f"{self.guides} guides" if self.guides else "no guides marked"
        return f"{self.strands} strands, {self.points} points, {guides}"


# ---------------------------------------------------------------- what is in the scene

def has_particle_hair(obj):
    return obj.type == "MESH" and any(s.settings.type == "HAIR" for s in obj.particle_systems)


def has_hair(obj):
    return obj.type == "CURVES" or has_particle_hair(obj)


def hair_of(objects, scene):
    """Those of the objects that have hair; an error says why there is none."""
    found = [o for o in objects if has_hair(o)]
    if found:
        return found
    if not objects:
        raise Refused("Nothing is selected: select hair curves, or meshes with particle hair, and export again")
    names = ", ".join(f"{o.name} ({o.type.lower()})" for o in objects[:4]) + (", …" if len(objects) > 4 else "")
    grown = [o.name for o in scene.objects if o.type == "CURVES" and o.data.surface in objects]
    hint = f": select {', '.join(grown)}, which grows on it" if grown else \
        ": hair curves (Add > Curve > Empty Hair) and particle systems of type Hair are exported, nothing else"
    raise Refused(f"There is no hair on {names}{hint}")


def metres(points, options, scene):
    """World space of Blender as metres with Y up."""
    unit = scene.unit_settings.scale_length if options.unit_scale else 1.0
    points = points * (unit * options.scale)
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], 1)


def placed(points, matrix, name):
    """Points of an object in world space, and how much larger widths become."""
    matrix = np.array(matrix, np.float64)
    size = abs(np.linalg.det(matrix[:3, :3])) ** (1 / 3)
    if not np.isfinite(matrix).all():
        raise Refused(f"{name}: its transform has numbers that are not finite: clear it (Alt G, Alt R, Alt S)")
    if size < 1e-9:
        raise Refused(f"{name}: it, or what it is parented to, is scaled to 0: set the scale and export again")
    return points @ matrix[:3, :3].T + matrix[:3, 3], size


def values_of(data, name, width, domains=("POINT", "CURVE")):
    """An attribute's numbers and domain; None if there is none."""
    attribute = data.attributes.get(name)
    if attribute is None or attribute.domain not in domains or len(attribute.data) == 0:
        return None, None
    kinds = {"FLOAT_VECTOR": "vector", "FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}
    sizes = {"FLOAT_VECTOR": 3, "FLOAT2": 2, "FLOAT_COLOR": 4, "BYTE_COLOR": 4, "FLOAT": 1, "INT": 1, "INT8": 1,
             "BOOLEAN": 1}
    size = sizes.get(attribute.data_type)
    if size is None or size < width:
        return None, None
    whole = {"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}.get(attribute.data_type, np.float32)
    values = np.empty(len(attribute.data) * size, whole)
    attribute.data.foreach_get(kinds.get(attribute.data_type, "value"), values)
    return values.reshape(-1, size)[:, :width], attribute.domain


def per_point(values, domain, counts):
    return np.repeat(values, counts, 0) if domain == "CURVE" else values


def base_color(material):
    """A material's colour in linear light, and why there is none."""
    if material is None:
        return None, None
    # From Blender 5.0 on all materials use nodes.
    has_nodes = bpy.app.version >= (5, 0, 0) or material.use_nodes
    if not has_nodes or material.node_tree is None:
        return material.diffuse_color[:3], None
    for node in material.node_tree.nodes:
        if node.type == "BSDF_HAIR_PRINCIPLED" and node.parametrization != "COLOR":
            return None, f"material {material.name}: its colour is melanin or absorption: set HairLook in the game"
        socket = {"BSDF_PRINCIPLED": "Base Color", "BSDF_HAIR_PRINCIPLED": "Color", "BSDF_HAIR": "Color",
                  "BSDF_DIFFUSE": "Color"}.get(node.type)
        if socket is not None:
            if node.inputs[socket].is_linked:
                return None, f"material {material.name}: its colour comes from other nodes, which are not evaluated"
            return tuple(node.inputs[socket].default_value)[:3], None
    return None, f"material {material.name}: no node with a colour that is known"


def colors_of_materials(materials, index, count):
    """Colours of strands by their materials: values, scope and notes."""
    found = [base_color(m) for m in materials]
    notes = [note for _, note in found if note]
    known = [color for color, _ in found]
    if index is not None and len(known) > 1:
        index = np.clip(index, 0, len(known) - 1)
        if all(known[i] is not None for i in set(index.tolist())):
            return np.array([known[i] for i in index], np.float32), "uni", notes
        return None, "con", notes
    if count and known and known[0] is not None:
        return np.array([known[0]], np.float32), "con", notes
    return None, "con", notes


class Surface:
    """UVs of the mesh that hair grows on, at the nearest places."""

    def __init__(self, surface, uv_map, depsgraph):
        evaluated = surface.evaluated_get(depsgraph)
        mesh = evaluated.data
        layer = mesh.uv_layers.get(uv_map) or mesh.uv_layers.active
        self.is_known = layer is not None and len(mesh.polygons) > 0
        if not self.is_known:
            return
        mesh.calc_loop_triangles()
        places = [evaluated.matrix_world @ v.co for v in mesh.vertices]
        triangles = [(tuple(t.vertices), tuple(t.loops)) for t in mesh.loop_triangles]
        self.corners = [([places[v] for v in vertices], [layer.data[i].uv.to_3d() for i in loops])
                        for vertices, loops in triangles]
        self.tree = BVHTree.FromPolygons(places, [vertices for vertices, _ in triangles])

    def uv(self, place):
        at, _, triangle, _ = self.tree.find_nearest(Vector(place))
        if at is None:
            return (0.0, 0.0)
        corners, uvs = self.corners[triangle]
        return tuple(barycentric_transform(at, *corners, *uvs))[:2]


class Sampled:
    """Points on curves as blends of control points: anchors, and two points between each two of Bezier curves."""

    def __init__(self, kinds, offsets):
        self.first, self.second, self.share, self.counts = [], [], [], []
        for kind, start, end in zip(kinds.tolist(), offsets[:-1].tolist(), offsets[1:].tolist()):
            before = len(self.first)
            for i in range(start, end):
                shares = (0.0, 1 / 3, 2 / 3) if kind == BEZIER and i + 1 < end else (0.0,)
                self.first += [i] * len(shares)
                self.second += [min(i + 1, end - 1)] * len(shares)
                self.share += shares
            self.counts.append(len(self.first) - before)
        self.first, self.second, self.share = (np.array(a) for a in (self.first, self.second, self.share))
        self.counts = np.array(self.counts, np.int32)

    def blended(self, values):
        t = self.share.reshape(-1, *[1] * (values.ndim - 1))
        return values[self.first] * (1 - t) + values[self.second] * t

    def on_curves(self, points, left, right):
        t = self.share[:, None]
        s = 1 - t
        return (points[self.first] * s**3 + right[self.first] * (3 * s * s * t)
                + left[self.second] * (3 * s * t * t) + points[self.second] * t**3)


def curves_hair(obj, depsgraph, options, scene, notes):
    """The hair of a `Curves` object."""
    evaluated = obj.evaluated_get(depsgraph)
    data = obj.data if options.original else evaluated.data
    if len(data.curves) == 0:
        is_emptied = not options.original and len(obj.data.curves) > 0
        why = ": its modifiers leave instances, which have to be realized, or meshes" if is_emptied else ""
        notes.append(f"{obj.name}: it has no strands{why}")
        return []
    offsets = np.empty(len(data.curve_offset_data), np.int32)
    data.curve_offset_data.foreach_get("value", offsets)
    counts = np.diff(offsets)
    local = np.empty(len(data.position_data) * 3, np.float32)
    data.position_data.foreach_get("vector", local)
    local = local.reshape(-1, 3).astype(np.float64)

    radii, domain = values_of(data, "radius", 1)
    widths = None if radii is None else 2.0 * per_point(radii, domain, counts)[:, 0]
    colors, scope = None, "con"
    if options.colors:
        is_color = {a.name for a in data.attributes if a.data_type in ("FLOAT_COLOR", "BYTE_COLOR")}
        name = next((n for n in ("groom_color", "color", "Color", "Cd", *sorted(is_color)) if n in is_color), None)
        if name is not None:
            colors, domain = values_of(data, name, 3)
            scope = "vtx" if domain == "POINT" else "uni"
        if colors is None:
            index, _ = values_of(data, "material_index", 1, ("CURVE",))
            colors, scope, why = colors_of_materials(
                [s.material for s in obj.material_slots], None if index is None else index[:, 0], len(counts))
            notes.extend(f"{obj.name}: {note}" for note in why)

    kinds, _ = values_of(data, "curve_type", 1, ("CURVE",))
    kinds = np.zeros(len(counts), np.int32) if kinds is None else kinds[:, 0]
    if (kinds == NURBS).any():
        raise Refused(f"{obj.name}: {int((kinds == NURBS).sum())} of its curves are NURBS, whose points lie beside "
                      "them: make them poly (in edit mode Curves > Set Curve Type) and export again")
    cyclic, _ = values_of(data, "cyclic", 1, ("CURVE",))
    if cyclic is not None and cyclic.any():
        notes.append(f"{obj.name}: {int(cyclic.sum())} closed curves are opened at their first point")
    if (kinds == BEZIER).any():
        sides = [values_of(data, f"handle_{side}", 3, ("POINT",))[0] for side in ("left", "right")]
        if any(side is None for side in sides):
            raise Refused(f"{obj.name}: its Bezier curves have no handles: make them poly and export again")
        sampled = Sampled(kinds, offsets)
        local = sampled.on_curves(local, *(side.astype(np.float64) for side in sides))
        widths = None if widths is None else sampled.blended(widths)
        colors = sampled.blended(colors) if colors is not None and scope == "vtx" else colors
        counts = sampled.counts

    world, size = placed(local, evaluated.matrix_world, obj.name)
    hair = Hair(obj.name, metres(world, options, scene), counts, colors=colors, color_scope=scope)
    if widths is None:
        notes.append(f"{obj.name}: no attribute “radius”, so no widths are written")
    else:
        unit = scene.unit_settings.scale_length if options.unit_scale else 1.0
        hair.widths = widths * (size * unit * options.scale)
    hair.uvs, _ = values_of(data, "surface_uv_coordinate", 2, ("CURVE",))
    if obj.data.surface is not None:
        hair.head = obj.data.surface.name
        if hair.uvs is None:
            surface = Surface(obj.data.surface, obj.data.surface_uv_map, depsgraph)
            if surface.is_known:
                roots = roots_of(world, counts)
                hair.uvs = np.array([surface.uv(r) if np.isfinite(r).all() else (0, 0) for r in roots], np.float32)
    if hair.uvs is None:
        notes.append(f"{obj.name}: neither an attribute “surface_uv_coordinate” nor a surface with UVs, so none "
                     "are written")
    marked, _ = values_of(data, "groom_guide", 1, ("CURVE",))
    if "guide" in obj.name.lower():
        hair.guides = np.ones(len(counts), bool)
    elif marked is not None:
        hair.guides = marked[:, 0] != 0
    groups, _ = values_of(data, "groom_group_id", 1, ("CURVE",))
    hair.groups = None if groups is None else groups[:, 0].astype(np.int32)
    for name in SHARES:
        shares, _ = values_of(data, name, 1, ("CURVE",))
        if shares is not None:
            hair.shares[name] = shares[:, 0]
    return [hair]


class AsRendered:
    """Particle systems with the steps and children of renders, for a while."""

    def __init__(self, objects, is_wanted):
        self.before = []
        self.changes = []
        if not is_wanted:
            return
        for obj in objects:
            for modifier in obj.modifiers:
                if modifier.type == "PARTICLE_SYSTEM" and modifier.particle_system.settings.type == "HAIR":
                    s = modifier.particle_system.settings
                    self.changes += [(modifier, "show_viewport", modifier.show_render),
                                     (s, "display_step", s.render_step), (s, "display_percentage", 100),
                                     (s, "child_percent", s.rendered_child_count)]

    def __enter__(self):
        for owner, name, value in self.changes:
            now = getattr(owner, name)
            if now != value:
                setattr(owner, name, value)
                self.before.append((owner, name, now))

    def __exit__(self, *_):
        for owner, name, value in reversed(self.before):
            setattr(owner, name, value)


def diameter(settings, share):
    """Of particle hair, from root to tip, as Cycles draws it."""
    thin = 1.0 - share
    shape = settings.shape
    if shape < 0.0:
        thin = thin ** (1.0 + shape)
    elif shape > 0.0:
        thin = thin ** (1.0 / max(1.0 - shape, 1e-6))
    wide = thin * (settings.root_radius - settings.tip_radius) + settings.tip_radius
    if settings.use_close_tip:
        wide[-1] = 0.0
    return wide * settings.radius_scale


def path_of(system, evaluated, number, steps):
    """The points of a particle's hair in world space. Beyond the end Blender gives zeros."""
    path = [system.co_hair(evaluated, particle_no=number, step=k) for k in range(steps)]
    while path and not any(path[-1]):
        path.pop()
    return path


def particle_hair(obj, depsgraph, options, scene, notes):
    """The hair of a mesh's particle systems: children, and their parents as guides."""
    evaluated = obj.evaluated_get(depsgraph)
    placed(np.zeros((0, 3)), evaluated.matrix_world, obj.name)
    found = []
    modifiers = {m.particle_system.name: m for m in evaluated.modifiers if m.type == "PARTICLE_SYSTEM"}
    for system in evaluated.particle_systems:
        settings, name = system.settings, f"{obj.name}, {system.name}"
        if settings.type != "HAIR":
            continue
        modifier = modifiers.get(system.name)
        if modifier is None or not modifier.show_viewport:
            notes.append(f"{name}: its modifier is off, so it is left out")
            continue
        if settings.render_type != "PATH":
            notes.append(f"{name}: it is rendered as {settings.render_type.lower()}, not as path, so it is left out")
            continue
        parents, children = len(system.particles), len(system.child_particles)
        if children and options.guides != "AUTO":
            numbers = range(0 if settings.use_parent_particles else parents, parents + children)
        else:
            numbers = range(parents + children)
        steps = 2 ** settings.display_step + 1 + settings.kink_extra_steps
        has_uvs = bool(evaluated.data.uv_layers)
        paths, uvs, is_parent, without = [], [], [], 0
        for number in numbers:
            path = path_of(system, evaluated, number, steps)
            if not path:
                without += 1
                continue
            paths.append(path)
            is_parent.append(number < parents)
            if has_uvs:
                parent = system.particles[min(number, parents - 1)]
                uvs.append(system.uv_on_emitter(modifier, particle=parent, particle_no=number, uv_no=0)[:2])
        if without:
            notes.append(f"{name}: {without} particles without a path are left out")
        if not paths:
            notes.append(f"{name}: no hair grows, so it is left out")
            continue
        counts = np.array([len(p) for p in paths], np.int32)
        world = np.array([tuple(p) for path in paths for p in path], np.float64)
        hair = Hair(system.name, metres(world, options, scene), counts, obj.name)
        hair.uvs = np.array(uvs, np.float32) if has_uvs else None
        if not has_uvs:
            notes.append(f"{name}: the mesh has no UVs, so none are written")
        thickness = settings.root_radius, settings.tip_radius, settings.radius_scale
        if np.allclose(thickness, UNSET_DIAMETERS):
            notes.append(f"{name}: its diameter is Blender's default of 10 mm, so no widths are written: set "
                         "Particle > Hair Shape")
        else:
            unit = scene.unit_settings.scale_length if options.unit_scale else 1.0
            hair.widths = np.concatenate([diameter(settings, np.linspace(0, 1, n)) for n in counts])
            hair.widths *= unit * options.scale
        slot = settings.material - 1
        if options.colors and slot < len(obj.material_slots):
            hair.colors, hair.color_scope, why = colors_of_materials([obj.material_slots[slot].material], None, 1)
            notes.extend(f"{name}: {note}" for note in why)
        if "guide" in system.name.lower():
            hair.guides = np.ones(len(counts), bool)
        elif children and options.guides == "AUTO":
            hair.guides = np.array(is_parent)
        found.append(hair)
    return found


def cleaned(hair, notes):
    """Without strands that no reader can take, each counted."""
    strands = np.ones(len(hair.counts), bool)
    owner = np.repeat(np.arange(len(hair.counts)), hair.counts)

    def left_out(bad, what):
        nonlocal strands
        bad &= strands
        if bad.any():
            first = int(np.flatnonzero(bad)[0])
            notes.append(f"{hair.name}: {int(bad.sum())} strands {what} are left out, the first is number {first}")
            strands &= ~bad

    left_out(hair.counts < 2, "of one point or none")
    broken = np.zeros(len(strands), bool)
    columns = [hair.points]
    columns += [hair.widths[:, None]] if hair.widths is not None else []
    columns += [hair.colors] if hair.color_scope == "vtx" and hair.colors is not None else []
    for values in columns:
        broken[owner[~np.isfinite(values).all(1)]] = True
    for values in [hair.uvs, hair.colors if hair.color_scope == "uni" else None]:
        if values is not None:
            broken |= ~np.isfinite(values).all(1)
    left_out(broken, "with a number that is not finite")
    size = np.zeros(len(strands))
    at = np.cumsum(hair.counts) - hair.counts
    with np.errstate(all="ignore"):
        apart = np.linalg.norm(np.nan_to_num(hair.points - hair.points[at[owner]]), axis=1)
    np.maximum.at(size, owner, apart)
    left_out(size < 1e-9, "without length")
    hair = hair.kept(strands)
    for name, shares in hair.shares.items():
        low, high = SHARES[name]
        within = np.clip(np.nan_to_num(shares, nan=1.0), low, high)
        if (within != shares).any():
            notes.append(f"{hair.name}: {int((within != shares).sum())} values of {name} are outside "
                         f"{low} to {high}: the nearest is written")
        hair.shares[name] = within
    if hair.widths is not None:
        negative = hair.widths < 0
        if negative.any():
            notes.append(f"{hair.name}: {int(negative.sum())} negative widths are written as 0")
            hair.widths[negative] = 0.0
        mean = float(hair.widths.mean()) if len(hair.widths) else 0.0
        if mean > THICK:
            notes.append(f"{hair.name}: strands are {mean * 1e3:.3g} mm thick, hair is 0.05 to 0.1 mm: set the radius")
    return hair


def farthest(roots, count):
    """Numbers of roots, each the farthest from all before it, the first nearest to the middle."""
    chosen = [int(np.argmin(np.linalg.norm(roots - roots.mean(0), axis=1)))]
    apart = np.full(len(roots), np.inf)
    while len(chosen) < min(count, len(roots)):
        apart = np.minimum(apart, ((roots - roots[chosen[-1]]) ** 2).sum(1))
        chosen.append(int(np.argmax(apart)))
    return chosen


def mark_guides(sets, options):
    """Flags of guides, as the option says."""
    for hair in sets:
        if options.guides == "AUTO":
            continue
        hair.guides = np.ones(len(hair.counts), bool) if options.guides == "ALL" else None
    if options.guides == "FARTHEST":
        roots = np.concatenate([hair.roots for hair in sets])
        flags = np.zeros(len(roots), bool)
        flags[farthest(roots, -(-len(roots) // max(options.every, 1)))] = True
        for hair, own in zip(sets, np.split(flags, np.cumsum([len(h.counts) for h in sets])[:-1])):
            hair.guides = own
    if any(hair.guides is not None and hair.guides.any() for hair in sets):
        for hair in sets:
            if hair.guides is None:
                hair.guides = np.zeros(len(hair.counts), bool)
    else:
        for hair in sets:
            hair.guides = None


def collect(context, objects, options):
    """The hair of objects, and what the artist should know."""
    found = Exported()
    objects = hair_of(list(objects), context.scene)
    meshes = [o for o in objects if has_particle_hair(o)]
    with AsRendered(meshes, options.as_rendered):
        depsgraph = context.evaluated_depsgraph_get()
        depsgraph.update()
        for obj in objects:
            of = curves_hair if obj.type == "CURVES" else particle_hair
            found.sets += of(obj, depsgraph, options, context.scene, found.notes)
    context.view_layer.update()
    found.sets = [hair for hair in (cleaned(hair, found.notes) for hair in found.sets) if len(hair.counts)]
    if not found.sets:
        raise Refused("No strand is left to export. " + ". ".join(found.notes))
    # What grows on one head lies together in the file.
    heads = list(dict.fromkeys(hair.head for hair in found.sets))
    found.sets.sort(key=lambda hair: heads.index(hair.head))
    mark_guides(found.sets, options)
    points = np.concatenate([hair.points for hair in found.sets])
    size = float((points.max(0) - points.min(0)).max())
    if not SIZES[0] <= size <= SIZES[1]:
        found.notes.append(f"The hair is {size:.3g} m large: check the scene's unit scale, or set the scale here")
    return found


# ---------------------------------------------------------------- the archive

DATA = 1 << 63
CURVES = "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1"
XFORM = "schema=AbcGeom_Xform_v3"
# Number of a type in headers, its name, and how it is written.
PODS = {"u8": (1, "uint8_t", "u1"), "i16": (4, "int16_t", "<i2"), "i32": (6, "int32_t", "<i4"),
        "f32": (10, "float32_t", "<f4"), "f64": (11, "float64_t", "<f8"), "text": (12, "string", None)}


class Archive:
    """An Ogawa archive on its way: parts before what they are in. Parts are pairs of header and position."""

    def __init__(self):
        # The mark of a finished file and the root's position come last.
        self.file = bytearray(b"Ogawa\0\0\x01" + bytes(8))
        self.metadata = [""]

    def data(self, content):
        if not content:
            return DATA
        at = len(self.file)
        self.file += struct.pack("<Q", len(content)) + content
        return at | DATA

    def group(self, children):
        if not children:
            return 0
        at = len(self.file)
        self.file += struct.pack(f"<{len(children) + 1}Q", len(children), *children)
        return at

    def sample(self, content):
        """Numbers behind a key, which is the same only for the same bytes."""
        return self.data(hashlib.blake2b(content, digest_size=16).digest() + content) if content else DATA

    def shared(self, metadata):
        if metadata not in self.metadata:
            self.metadata.append(metadata)
        return self.metadata.index(metadata)

    def holding(self, before, parts, hashes=b""):
        headers = b"".join(header for header, _ in parts) + hashes
        if not headers:
            return 0
        return self.group([*before, *(at for _, at in parts), self.data(headers)])

    def property(self, name, metadata, kind, at, is_scalar_or_array):
        # Lengths of 32 bits; one constant sample.
        info = kind | self.shared(metadata) << 20 | 0b1000 | (0xC00 if is_scalar_or_array else 0)
        header = struct.pack("<I", info) + (struct.pack("<I", 1) if is_scalar_or_array else b"")
        name = name.encode()
        return header + struct.pack("<I", len(name)) + name, at

    def compound(self, name, metadata, parts):
        return self.property(name, metadata, 0, self.holding([], parts), False)

    def scalar(self, name, metadata, pod, values):
        number, _, kind = PODS[pod]
        values = np.asarray(values).astype(kind).ravel()
        at = self.group([self.sample(values.tobytes())])
        return self.property(name, metadata, len(values) << 12 | number << 4 | 1, at, True)

    def array(self, name, metadata, pod, values, extent=1):
        number, _, kind = PODS[pod]
        content = values.encode() + b"\0" if pod == "text" else np.asarray(values).astype(kind).tobytes()
        at = self.group([self.sample(content), DATA])
        return self.property(name, metadata, extent << 12 | number << 4 | 2, at, True)

    def attribute(self, name, scope, pod, values, extent=1):
        meaning = {2: "interpretation=vector;", 3: "interpretation=rgb;"}.get(extent, "")
        metadata = f"arrayExtent=1;geoScope={scope};{meaning}isGeomParam=true;podExtent={extent};" \
                   f"podName={PODS[pod][1]}"
        return self.array(name, metadata, pod, values, extent)

    def object(self, name, metadata, properties, children=()):
        at = self.holding([self.holding([], properties)], children, bytes(32))
        name = name.encode()
        return struct.pack("<I", len(name)) + name + bytes([self.shared(metadata)]), at

    def finished(self, top):
        top = self.holding([0], top, bytes(32))
        metadata = b"".join(bytes([len(m)]) + m.encode() for m in self.metadata[1:])
        about = f"_ai_Application=bevy_keratin, Blender {bpy.app.version_string}".encode()
        times = struct.pack("<IdId", 1, 1.0, 1, 0.0)
        parts = [self.data(struct.pack("<i", 0)), self.data(struct.pack("<i", 10803)), top, self.data(about),
                 self.data(times), self.data(metadata)]
        root = self.group(parts)
        self.file[5] = 0xFF
        self.file[8:16] = struct.pack("<Q", root)
        return bytes(self.file)


def titled(schema, title):
    return f"{schema};schemaObjTitle=AbcGeom_{title}"


def curve_set(archive, name, hair, group):
    bounds = np.concatenate([hair.points.min(0), hair.points.max(0)])
    parts = [
        archive.scalar(".selfBnds", "interpretation=box", "f64", bounds),
        archive.array("P", "geoScope=vtx;interpretation=point", "f32", hair.points, 3),
        archive.array("nVertices", "", "i32", hair.counts),
        archive.scalar("curveBasisAndType", "", "u8", [1, 0, 0, 0]),  # linear, open, no basis
    ]
    if hair.widths is not None:
        parts.append(archive.attribute("width", "vtx", "f32", hair.widths))
    # Unreal Engine's names.
    attributes = [archive.attribute("groom_group_name", "con", "text", hair.name)]
    if hair.groups is None:
        attributes.append(archive.attribute("groom_group_id", "con", "i32", [group]))
    else:
        attributes.append(archive.attribute("groom_group_id", "uni", "i32", hair.groups))
    if hair.uvs is not None:
        attributes.append(archive.attribute("groom_root_uv", "uni", "f32", hair.uvs, 2))
    if hair.colors is not None:
        attributes.append(archive.attribute("groom_color", hair.color_scope, "f32", hair.colors, 3))
    if hair.guides is not None:
        attributes.append(archive.attribute("groom_guide", "uni", "i16", hair.guides))
    for attribute, shares in hair.shares.items():
        attributes.append(archive.attribute(attribute, "uni", "f32", shares))
    parts.append(archive.compound(".arbGeomParams", "", attributes))
    return archive.object(name, titled(CURVES, "Curve_v2:.geom"), [archive.compound(".geom", CURVES, parts)])


def unused(name, names):
    """A name that its neighbours do not have and a path can hold."""
    plain = "".join("_" if c in "/\\;:=\0" else c for c in name) or "hair"
    wanted, k = plain, 1
    while wanted in names:
        k += 1
        wanted = f"{plain}_{k}"
    names.add(wanted)
    return wanted


def archive_of(sets):
    """The bytes of a file: /groom/HEAD/HAIR/HAIR, or /groom/HAIR/HAIR where nothing is known that it grows on."""
    archive = Archive()

    def transform(name, children, attributes=()):
        # No operations are the identity: points are in world space.
        parts = [archive.compound(".arbGeomParams", "", list(attributes))] if attributes else []
        xform = archive.compound(".xform", XFORM, parts)
        return archive.object(name, titled(XFORM, "Xform_v3:.xform"), [xform], children)

    children, names, group = [], set(), 0
    for head in dict.fromkeys(hair.head for hair in sets):
        inside, taken = [], names if not head else set()
        for hair in (h for h in sets if h.head == head):
            # Each below a transform of its own, as importers expect it.
            name = unused(hair.name, taken)
            inside.append(transform(name, [curve_set(archive, name, hair, group)]))
            group += 1
        children += [transform(unused(head, names), inside)] if head else inside
    version = [archive.attribute("groom_version_major", "con", "i16", [1]),
               archive.attribute("groom_version_minor", "con", "i16", [5])]
    return archive.finished([transform("groom", children, version)])


def export(context, path, objects, options):
    """Writes the hair of objects, all or nothing; says what was written."""
    found = collect(context, objects, options)
    content = archive_of(found.sets)
    beside = f"{path}.part"
    try:
        with open(beside, "wb") as file:
            file.write(content)
        os.replace(beside, path)
    except OSError as error:
        raise Refused(f"{path} cannot be written: {error.strerror}") from error
    return found


# ---------------------------------------------------------------- in the window

class ExportKeratin(bpy.types.Operator, ExportHelper):
    """Export selected hair curves and particle hair of selected meshes as a groom for bevy_keratin"""

    bl_idname = "export_scene.bevy_keratin"
    bl_label = "Export hair"
    bl_options = {"PRESET"}

    filename_ext = ".abc"
    filter_glob: StringProperty(default="*.abc", options={"HIDDEN"})
    guides: EnumProperty(
        name="Guides",
        description="Which strands are simulated; the others follow them",
        items=(
            ("AUTO", "As in Blender", "Parents of particle hair with children, objects whose name has “guide”, and "
             "strands with the attribute groom_guide; where there are none, the game chooses"),
            ("FARTHEST", "Evenly spread", "One in every so many strands, as far from each other as possible"),
            ("ALL", "All", "Every strand may be simulated"),
            ("NONE", "None", "None is marked: the game chooses"),
        ),
        default="AUTO",
    )
    every: IntProperty(name="One in", description="With evenly spread guides: how many strands to a guide",
                       default=10, min=1, soft_max=1000)
    original: BoolProperty(name="Without modifiers", description="Hair curves as they are edited", default=False)
    as_rendered: BoolProperty(name="Particles as rendered", description="Steps and children of renders instead of "
                              "those of the viewport", default=True)
    colors: BoolProperty(name="Colours", description="Of a colour attribute, else of the material", default=True)
    unit_scale: BoolProperty(name="Scene's unit", description="Apply the scene's unit scale, so that the file is in "
                             "metres. Blender's glTF exporter does not", default=True)
    scale: FloatProperty(name="Scale", default=1.0, min=1e-6, max=1e6)

    def execute(self, context):
        options = Options(self.guides, self.every, self.original, self.as_rendered, self.colors, self.unit_scale,
                          self.scale)
        if context.object is not None and context.object.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")  # what is being edited reaches its object
        try:
            found = export(context, self.filepath, list(context.selected_objects), options)
        except Refused as refused:
            self.report({"ERROR"}, str(refused))
            return {"CANCELLED"}
        for note in found.notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, f"{found} in {self.filepath}")
        return {"FINISHED"}


def menu(self, _):
    self.layout.operator(ExportKeratin.bl_idname, text="Hair for bevy_keratin (.abc)")


def register():
    bpy.utils.register_class(ExportKeratin)
    bpy.types.TOPBAR_MT_file_export.append(menu)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(menu)
    bpy.utils.unregister_class(ExportKeratin)


# ---------------------------------------------------------------- without a window

def main(arguments):
    """The command line; returns its exit status."""
    a = argparse.ArgumentParser(prog="keratin_export.py", description=__doc__.split("\n")[0])
    a.add_argument("--out", required=True, metavar="HAIR.abc")
    a.add_argument("--blend", metavar="FILE", help="opens this file first (else the one that Blender has open)")
    a.add_argument("--objects", nargs="+", metavar="NAME", help="default: all visible objects with hair")
    a.add_argument("--selected", action="store_true", help="those that were selected when the file was saved")
    a.add_argument("--guides", choices=("auto", "farthest", "all", "none"), default="auto")
    a.add_argument("--every", type=int, default=10, metavar="N", help="strands to a guide, with --guides farthest")
    a.add_argument("--original", action="store_true", help="hair curves without their modifiers")
    a.add_argument("--viewport", action="store_true", help="particle hair as in the viewport, not as rendered")
    a.add_argument("--no-colors", action="store_true")
    a.add_argument("--no-unit-scale", action="store_true", help="one Blender unit is a metre, whatever the scene says")
    a.add_argument("--scale", type=float, default=1.0)
    a = a.parse_args(arguments)
    try:
        if a.blend:
            try:
                bpy.ops.wm.open_mainfile(filepath=os.path.abspath(a.blend))
            except RuntimeError as error:
                raise Refused(f"{a.blend} cannot be opened: {error}") from error
        context = bpy.context
        if a.objects:
            missing = [name for name in a.objects if name not in context.view_layer.objects]
            if missing:
                there = ", ".join(o.name for o in context.view_layer.objects if has_hair(o)) or "none"
                raise Refused(f"No object named {', '.join(missing)}; those with hair: {there}")
            objects = [context.view_layer.objects[name] for name in a.objects]
        elif a.selected:
            objects = [o for o in context.view_layer.objects if o.select_get()]
        else:
            objects = [o for o in context.view_layer.objects if has_hair(o) and o.visible_get()]
            if not objects:
                raise Refused("There is no visible object with hair in this file")
        options = Options(a.guides.upper(), a.every, a.original, not a.viewport, not a.no_colors,
                          not a.no_unit_scale, a.scale)
        found = export(context, a.out, objects, options)
    except Refused as refused:
        print(f"error: {refused}", file=sys.stderr)
        return 1
    for note in found.notes:
        print(f"note: {note}")
    print(f"{found} in {a.out}")
    return 0


if __name__ == "__main__":
    if "--" in sys.argv:
        sys.exit(main(sys.argv[sys.argv.index("--") + 1:]))
    elif len(sys.argv) > 1 and os.path.basename(sys.argv[0]) == os.path.basename(__file__):
        sys.exit(main(sys.argv[1:]))
    else:  # run in Blender's text editor
        register()
