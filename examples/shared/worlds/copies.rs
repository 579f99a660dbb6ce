//! Copies, scenes and meshes that change: what is measured of each.

use super::{
    Row, app_with_meshes, fault_count, run,
    scenes::{load, name_assets, save},
    strands_of,
    wearer::{HALF, MIDDLE, ball, character},
};
use bevy::{
    ecs::entity::EntityHashMap,
    mesh::{
        Mesh, Mesh3d, VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use bevy_keratin::{
    authoring::{
        attach::RootsOnMesh,
        groom::{Groom, GroomedHair},
        plant::{Planted, Planting, RootOnMesh},
    },
    hair::strand::StrandHistory,
    prelude::*,
};
use std::{thread::sleep, time::Duration};

/// Radius of the head (m) and length of its hair (m).
pub(super) const HEAD: f32 = 0.1;
pub(super) const LONG: f32 = 0.2;

pub(super) fn head(radius: f32) -> Mesh {
    Sphere::new(radius).mesh().uv(24, 16)
}

fn planted() -> Planted {
    let planting = Planting { density: 400.0, length: LONG, nodes: 8, ..default() };
    planting.plant(&head(HEAD)).unwrap()
}

/// A head in a world without gravity, with hair that is no child of it.
pub(super) struct Groomed {
    pub(super) app: App,
    pub(super) planted: Planted,
    pub(super) body: Entity,
    pub(super) hair: Entity,
}

/// On a mesh that is `scale` times as large as planted.
pub(super) fn groomed(scale: f32) -> Groomed {
    let mut app = app_with_meshes();
    app.insert_resource(HairGravity(Vec3::ZERO));
    let body = body_at(&mut app, head(HEAD), place(scale));
    let planted = planted();
    let hair = app.world_mut().spawn((Hair, Transform::from_xyz(0.4, 0.1, 0.0))).id();
    for strand in planted.groom.strands() {
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(strand.points).unwrap()));
    }
    let roots = RootsOnMesh { mesh: Some(body), roots: planted.roots.clone(), ..default() };
    app.world_mut().entity_mut(hair).insert(roots);
    run(&mut app, 0.1);
    Groomed { app, planted, body, hair }
}

pub(super) fn place(scale: f32) -> Transform {
    Transform::from_xyz(0.3, 0.2, -0.1)
        .with_rotation(Quat::from_rotation_x(0.8))
        .with_scale(Vec3::splat(scale))
}

fn body_at(app: &mut App, mesh: Mesh, place: Transform) -> Entity {
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
    app.world_mut().spawn((Mesh3d(mesh), place)).id()
}

pub(super) fn longest(app: &App, hair: Entity) -> f32 {
    strands_of(app, hair).iter().map(Strand::length).fold(0.0, f32::max)
}

/// The longest way between the same nodes (m).
fn apart(a: &[Strand], b: &[Strand]) -> f32 {
    let nodes = |all: &[Strand]| -> Vec<Vec3> {
        all.iter().flat_map(|strand| strand.positions().to_vec()).collect()
    };
    let (a, b) = (nodes(a), nodes(b));
    if a.len() != b.len() {
        return f32::INFINITY;
    }
    a.iter().zip(&b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// How far roots are at most from where `surface` has them, in the world (m); those of every `step`-th strand.
pub(super) fn off_skin(groomed: &Groomed, step: usize, surface: impl Fn(Vec3) -> Vec3) -> f32 {
    let world = groomed.app.world();
    let frame = world.get::<Transform>(groomed.hair).unwrap();
    let planted = groomed.planted.groom.strands().step_by(step).map(|strand| strand.points[0]);
    let now = strands_of(&groomed.app, groomed.hair);
    if now.len() != planted.len() {
        return f32::INFINITY;
    }
    let off = planted.zip(&now).map(|(planted, strand)| {
        frame.transform_point(strand.positions()[0]).distance(surface(planted))
    });
    off.fold(0.0, f32::max)
}

/// Line 12: what happens to hair whose roots are touched three times, against hair that is left alone: the longest
/// strand (m), how far any node is from that of the control (m), and faults.
fn touched(touch: impl Fn(&mut Groomed)) -> [f32; 3] {
    let [mut own, mut control] = [groomed(2.0), groomed(2.0)];
    for _ in 0..3 {
        touch(&mut own);
        [&mut own.app, &mut control.app].into_iter().for_each(|app| run(app, 0.05));
    }
    let faults = fault_count(&own.app);
    let (own, control) = (strands_of(&own.app, own.hair), strands_of(&control.app, control.hair));
    let longest = own.iter().map(Strand::length).fold(0.0, f32::max);
    [longest, apart(&own, &control), faults]
}

/// A head between two joints with blended weights, bent by `bend` rad.
fn neck(bend: f32) -> Groomed {
    let mut groomed = groomed(1.0);
    let world = groomed.app.world_mut();
    let joints = [Vec3::ZERO, Vec3::new(0.0, 0.0, 0.02)];
    let mut mesh = head(HEAD);
    let Some(VertexAttributeValues::Float32x3(at)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION)
    else {
        unreachable!()
    };
    let share = |p: &[f32; 3]| (0.5 + 5.0 * p[2]).clamp(0.0, 1.0);
    let weights: Vec<[f32; 4]> = at.iter().map(|p| [1.0 - share(p), share(p), 0.0, 0.0]).collect();
    let indices = VertexAttributeValues::Uint16x4(vec![[0, 1, 0, 0]; at.len()]);
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, indices);
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights);
    let inverse = joints.map(|at| Mat4::from_translation(-at)).to_vec();
    let inverse_bindposes =
        world.resource_mut::<Assets<_>>().add(SkinnedMeshInverseBindposes::from(inverse));
    let joints = joints.map(|at| world.spawn(Transform::from_translation(at)).id()).to_vec();
    let upper = joints[1];
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
    let body = world.spawn((Mesh3d(mesh), SkinnedMesh { inverse_bindposes, joints })).id();
    let roots = groomed.planted.roots.clone();
    let hair = world.spawn(Hair).id();
    for strand in groomed.planted.groom.strands() {
        world.spawn((StrandOf(hair), Strand::from_polyline(strand.points).unwrap()));
    }
    world.entity_mut(hair).insert(RootsOnMesh { mesh: Some(body), roots, ..default() });
    (groomed.body, groomed.hair) = (body, hair);
    run(&mut groomed.app, 0.05);
    *groomed.app.world_mut().get_mut::<Transform>(upper).unwrap() =
        Transform::from_xyz(0.0, 0.0, 0.02).with_rotation(Quat::from_rotation_x(bend));
    run(&mut groomed.app, 1.0);
    groomed
}

/// Line 12: how far roots and nodes jump in the tick after a touch in a bent pose (m).
fn jump_when_touched(touch: bool) -> f32 {
    let mut own = neck(1.2);
    let before = strands_of(&own.app, own.hair);
    if touch {
        own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().set_changed();
    }
    run(&mut own.app, 1.0 / 60.0);
    apart(&before, &strands_of(&own.app, own.hair))
}

/// Line 12: another mesh is named that is as large as planted, elsewhere: how far roots are off it (m), the
/// longest strand (m),
/// how much any joint is bent by that (rad), and faults.
fn moved_to_another_mesh(is_other: bool) -> [f32; 4] {
    let mut own = groomed(2.0);
    let there = Transform::from_xyz(-2.0, 0.0, 1.0);
    let other = body_at(&mut own.app, head(HEAD), there);
    let shape = shape(&own);
    if is_other {
        own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().mesh = Some(other);
    }
    run(&mut own.app, 0.1);
    let surface = if is_other { there } else { place(2.0) };
    let bent = self::shape(&own).iter().zip(&shape).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    let off = off_skin(&own, 1, |p| surface.transform_point(p));
    [off, longest(&own.app, own.hair), bent, fault_count(&own.app)]
}

/// How much each joint is bent (rad).
fn shape(groomed: &Groomed) -> Vec<f32> {
    let bend = |strand: &Strand| -> Vec<f32> {
        (1..strand.edges()).map(|i| 2.0 * strand.darboux(i).xyz().length()).collect()
    };
    strands_of(&groomed.app, groomed.hair).iter().flat_map(bend).collect()
}

/// Line 12: every second strand is shaved off, roots are touched, and the mesh moves: how far roots are off (m),
/// and faults.
fn shaved(touch: bool) -> [f32; 2] {
    let mut own = groomed(1.0);
    let members: Vec<Entity> = own.app.world().get::<Strands>(own.hair).unwrap().iter().collect();
    for shaved in members.iter().skip(1).step_by(2) {
        own.app.world_mut().entity_mut(*shaved).despawn();
    }
    if touch {
        own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().set_changed();
    }
    run(&mut own.app, 0.05);
    let there = Transform::from_xyz(0.35, 0.2, -0.1).with_rotation(Quat::from_rotation_y(0.3));
    *own.app.world_mut().get_mut::<Transform>(own.body).unwrap() = there;
    run(&mut own.app, 0.2);
    [off_skin(&own, 2, |p| there.transform_point(p)), fault_count(&own.app)]
}

/// A character with worn hair, and another of it that stands `AWAY` from it.
pub(super) struct Pair {
    pub(super) app: App,
    /// The wearer, its hair and the mesh of its head: the original's, then the other's.
    pub(super) wearers: Vec<Entity>,
}

const AWAY: Vec3 = Vec3::new(3.0, 0.0, 0.0);

/// How the other character comes to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Copied {
    /// There is only the original.
    No,
    Cloned,
    /// Saved as a scene and loaded beside it.
    Loaded,
}

/// A few strands that stand off the upper half of an ellipsoid.
fn short_groom(app: &mut App, middle: Vec3, half: Vec3) -> Handle<Groom> {
    let strand = |k: usize| {
        let (sine, cosine) = (2.4 * k as f32).sin_cos();
        let up = 0.3 + 0.03 * k as f32;
        let wide = (1.0 - up * up).sqrt();
        let way = Vec3::new(wide * cosine, up, wide * sine);
        [0.0, 0.02, 0.04, 0.06].map(|out| middle + half * way + out * way)
    };
    let groom = Groom::from_polylines((0..20).map(strand)).unwrap();
    app.world_mut().resource_mut::<Assets<Groom>>().add(groom)
}

pub(super) fn pair(copied: Copied, colliders: bool) -> Pair {
    let mut app = app_with_meshes();
    let groom = short_groom(&mut app, MIDDLE, HALF);
    let wear = WearHair { colliders, ..WearHair::new(groom) };
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    character(&mut app, root, 1.0);
    name_assets(&mut app, root);
    let hair = worn(&mut app, root);
    run(&mut app, 0.2);
    // A style to be remembered.
    app.world_mut().write_message(HairTreatment::set(hair, BondKind::Hydrogen, 0.25).unwrap());
    run(&mut app, 0.1);
    let mut wearers = vec![root];
    match copied {
        Copied::No => {}
        Copied::Cloned => wearers.push(clone(&mut app, root)),
        Copied::Loaded => {
            let saved = save(&mut app, root);
            wearers.push(load(&mut app, &saved)[&root]);
        }
    }
    if let Some(copy) = wearers.get(1) {
        app.world_mut().get_mut::<Transform>(*copy).unwrap().translation = AWAY;
    }
    Pair { app, wearers }
}

/// An entity and all below it, strands included, in an order that is the same in copies.
pub(super) fn everything(world: &World, root: Entity) -> Vec<Entity> {
    let mut found = vec![root];
    let mut next = 0;
    while let Some(&at) = found.get(next) {
        found.extend(world.get::<Children>(at).into_iter().flatten());
        found.extend(world.get::<Strands>(at).into_iter().flat_map(|strands| strands.iter()));
        next += 1;
    }
    found
}

fn clone(app: &mut App, root: Entity) -> Entity {
    let world = app.world_mut();
    let copy = world.entity_mut(root).clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    // Bevy leaves joints that are deeper than their mesh at the original's.
    let map: EntityHashMap<Entity> =
        everything(world, root).into_iter().zip(everything(world, copy)).collect();
    for mesh in map.values() {
        if let Some(mut skin) = world.get_mut::<SkinnedMesh>(*mesh) {
            skin.joints.iter_mut().for_each(|joint| *joint = *map.get(joint).unwrap_or(joint));
        }
    }
    copy
}

/// Waits for the hair of a wearer.
fn worn(app: &mut App, wearer: Entity) -> Entity {
    for _ in 0..4000 {
        app.update();
        if let Some(hair) = hair_of(app, wearer).first() {
            return *hair;
        }
        sleep(Duration::from_millis(2));
    }
    panic!("no hair is worn after 8 s");
}

pub(super) fn hair_of(app: &mut App, wearer: Entity) -> Vec<Entity> {
    app.world().get::<WornHair>(wearer).map_or_else(Vec::new, |worn| worn.collection().clone())
}

pub(super) fn count<T: Component>(app: &mut App) -> usize {
    app.world_mut().query::<&T>().iter(app.world()).count()
}

/// Roots in the world, strand by strand.
pub(super) fn roots_in_world(app: &App, hair: Entity) -> Vec<Vec3> {
    let frame = app.world().get::<GlobalTransform>(hair).unwrap();
    strands_of(app, hair).iter().map(|s| frame.transform_point(s.positions()[0])).collect()
}

/// Lines 11 and 14: how many hairs there are of each wearer, and the ratio of colliders to those of one.
fn hairs_and_colliders(copied: Copied) -> (Vec<usize>, f32) {
    let mut alone = pair(Copied::No, true);
    run(&mut alone.app, 0.2);
    let mut own = pair(copied, true);
    // Time for a second hair to be made, if one is.
    for _ in 0..60 {
        own.app.update();
        sleep(Duration::from_millis(1));
    }
    let hairs = own.wearers.clone().into_iter().map(|wearer| hair_of(&mut own.app, wearer).len());
    let hairs = hairs.collect();
    let colliders = count::<HairCollider>(&mut own.app) as f32;
    (hairs, colliders / count::<HairCollider>(&mut alone.app) as f32)
}

/// Lines 11 and 14: how far roots of the other character are from those of the original at most, less where it
/// stands (m), at once and after it has walked away.
fn roots_of_copy(copied: Copied) -> [f32; 2] {
    let mut own = pair(copied, false);
    let hairs: Vec<Entity> =
        own.wearers.clone().into_iter().map(|wearer| hair_of(&mut own.app, wearer)[0]).collect();
    let mut walked = Vec3::ZERO;
    [(); 2].map(|()| {
        own.app.world_mut().get_mut::<Transform>(own.wearers[1]).unwrap().translation =
            AWAY + walked;
        run(&mut own.app, 0.2);
        let [original, other] = [hairs[0], hairs[1]].map(|hair| roots_in_world(&own.app, hair));
        if original.len() != other.len() {
            return f32::INFINITY;
        }
        let pairs = original.iter().zip(&other);
        let off = pairs.map(|(a, b)| (*a + AWAY + walked).distance(*b)).fold(0.0, f32::max);
        walked += Vec3::new(0.0, 0.0, 0.4);
        off
    })
}

/// Lines 11 and 14: the largest difference of any joint's bonds and of any length (m) between both hairs at once.
fn style_of_copy(copied: Copied) -> f32 {
    let mut own = pair(copied, false);
    let wearers = own.wearers.clone();
    let hairs: Vec<Entity> = wearers.iter().map(|w| hair_of(&mut own.app, *w)[0]).collect();
    let world = own.app.world();
    let of = |hair: Entity| -> Vec<(Strand, Bonds)> {
        let members = world.get::<Strands>(hair).unwrap().iter();
        members
            .map(|id| {
                (world.get::<Strand>(id).unwrap().clone(), world.get::<Bonds>(id).unwrap().clone())
            })
            .collect()
    };
    let mut off = 0.0_f32;
    for ((a, bonds_a), (b, bonds_b)) in of(hairs[0]).iter().zip(&of(hairs[1])) {
        off = off.max((a.length() - b.length()).abs());
        for (a, b) in bonds_a.joints.iter().zip(&bonds_b.joints) {
            let rates = a.rates.iter().zip(&b.rates).map(|(a, b)| (a - b).abs());
            let shapes = a.shapes.iter().zip(&b.shapes).map(|(a, b)| a.distance(*b));
            off = rates.chain(shapes).fold(off, f32::max);
        }
    }
    off
}

/// Line 11: strands of hair that is grown from a groom and cloned, and of its clone, before and after the clone
/// lets go of the groom.
fn strands_of_cloned_groom() -> [[usize; 2]; 2] {
    let mut app = app_with_meshes();
    let lines = (0..20).map(|k| {
        let root = Vec3::X * (0.01 * k as f32);
        [root, root + Vec3::Y * 0.05, root + Vec3::Y * 0.1]
    });
    let groom = Groom::from_polylines(lines).unwrap();
    let groom = app.world_mut().resource_mut::<Assets<Groom>>().add(groom);
    let hair = app.world_mut().spawn((GroomedHair::new(groom), Transform::default())).id();
    run(&mut app, 0.1);
    let copy = clone(&mut app, hair);
    run(&mut app, 0.1);
    let count = |app: &App| [hair, copy].map(|hair| strands_of(app, hair).len());
    let cloned = count(&app);
    app.world_mut().entity_mut(copy).remove::<GroomedHair>();
    run(&mut app, 0.1);
    [cloned, count(&app)]
}

/// How a mesh is changed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Edit {
    Not,
    Vertices,
    Mesh3d,
}

/// Makes a mesh larger.
fn enlarge(app: &mut App, body: Entity, mesh: Mesh, by: f32, edit: Edit) {
    let world = app.world_mut();
    let larger = mesh.scaled_by(Vec3::splat(by));
    let handle = world.get::<Mesh3d>(body).unwrap().0.clone();
    match edit {
        Edit::Not => {}
        Edit::Vertices => {
            let mut meshes = world.resource_mut::<Assets<Mesh>>();
            *meshes.get_mut(&handle).unwrap() = larger;
        }
        Edit::Mesh3d => {
            let larger = world.resource_mut::<Assets<Mesh>>().add(larger);
            world.get_mut::<Mesh3d>(body).unwrap().0 = larger;
        }
    }
}

/// Line 13: a mesh is edited to 1.25 times its size: how far roots are off it then (m), the longest strand (m), and
/// faults.
fn edited(edit: Edit) -> [f32; 3] {
    let mut own = groomed(1.0);
    enlarge(&mut own.app, own.body, head(HEAD), 1.25, edit);
    run(&mut own.app, 0.2);
    let by = if edit == Edit::Not { 1.0 } else { 1.25 };
    let off = off_skin(&own, 1, |p| place(1.0).transform_point(p * by));
    [off, longest(&own.app, own.hair), fault_count(&own.app)]
}

/// Line 13: a mesh that is edited in every frame: how far drawn roots are off it at most, as it was a
/// frame ago (m).
fn drawn_off_pulsing_mesh() -> f32 {
    let mut own = groomed(1.0);
    let (mut worst, mut before) = (0.0_f32, 1.0);
    for frame in 0..30 {
        let by = 1.0 + 0.2 * (0.3 * frame as f32).sin();
        enlarge(&mut own.app, own.body, head(HEAD), by, Edit::Vertices);
        own.app.update();
        let world = own.app.world();
        let members = world.get::<Strands>(own.hair).unwrap();
        let overstep = world.resource::<Time<Fixed>>().overstep_fraction();
        let frame = world.get::<GlobalTransform>(own.hair).unwrap();
        for (id, planted) in members.iter().zip(own.planted.groom.strands()) {
            let history = world.get::<StrandHistory>(id).unwrap();
            let drawn = history.drawn(world.get::<Strand>(id).unwrap(), 0, overstep);
            let skin = place(1.0).transform_point(planted.points[0] * before);
            worst = worst.max(frame.transform_point(drawn).distance(skin));
        }
        before = by;
    }
    worst
}

/// The farthest reach of worn hair's colliders from the middle of a head on its own mesh (m).
fn reach_of_colliders(app: &mut App) -> f32 {
    let world = app.world_mut();
    let mut all = world.query::<(&HairCollider, &GlobalTransform)>();
    let reach = all.iter(world).map(|(collider, place)| {
        let ball = match collider.shape {
            ColliderShape::Sphere(ball) => ball.radius * place.scale().max_element(),
            _ => 0.0,
        };
        place.translation().length() + ball
    });
    reach.fold(0.0, f32::max)
}

/// Line 13: how much farther the colliders of worn hair reach, and the median of its roots is from the middle, after
/// an edit to 1.3 times the size; and whether hair was made again.
fn worn_on_edited_head(edit: Edit) -> ([f32; 2], bool) {
    let mut app = app_with_meshes();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1));
    let wear = WearHair::new(short_groom(&mut app, Vec3::ZERO, Vec3::splat(0.1)));
    let head = app.world_mut().spawn((Mesh3d(mesh), Transform::default(), wear)).id();
    let hair = worn(&mut app, head);
    run(&mut app, 0.1);
    let measure = |app: &mut App, hair| {
        let mut roots: Vec<f32> = roots_in_world(app, hair).iter().map(|p| p.length()).collect();
        roots.sort_by(f32::total_cmp);
        [reach_of_colliders(app), roots[roots.len() / 2]]
    };
    let before = measure(&mut app, hair);
    enlarge(&mut app, head, ball(0.1), 1.3, edit);
    // Nothing comes of no edit, which takes all of the time.
    let most = if edit == Edit::Not { 400 } else { 4000 };
    for _ in 0..most {
        app.update();
        sleep(Duration::from_millis(2));
        let after = measure(&mut app, hair);
        if edit != Edit::Not && after.iter().zip(&before).all(|(a, b)| a / b > 1.25) {
            break;
        }
    }
    let hairs = hair_of(&mut app, head);
    let after = measure(&mut app, hairs[0]);
    ([after[0] / before[0], after[1] / before[1]], hairs != [hair])
}

/// Line 12: roots that are touched again, moved and thinned out.
pub fn roots() -> Vec<Row> {
    let mut rows = Vec::new();
    let touches: [(&str, fn(&mut Groomed)); 3] = [
        ("control, roots untouched", |_| {}),
        ("roots touched by set_changed", |own| {
            own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().set_changed();
        }),
        ("roots touched by an equal value", |own| {
            let equal = own.app.world().get::<RootsOnMesh>(own.hair).unwrap().clone();
            own.app.world_mut().entity_mut(own.hair).insert(equal);
        }),
    ];
    for (what, touch) in touches {
        let [length, apart, faults] = touched(touch);
        rows.extend([
            Row::new(format!("{what}: longest strand (m)"), 2.0 * LONG, length, 1e-3),
            Row::at_most(format!("{what}: off the control (m)"), apart, 1e-4),
            Row::at_most(format!("{what}: faults"), faults, 0.0),
        ]);
    }
    let [control, touched] = [false, true].map(jump_when_touched);
    rows.push(Row::new("blended skin, bent, roots touched: jump (m)", control, touched, 1e-6));
    for (what, is_other, scale) in
        [("control, the mesh it is on", false, 2.0), ("another mesh named", true, 1.0)]
    {
        let [off, length, bent, faults] = moved_to_another_mesh(is_other);
        rows.extend([
            Row::at_most(format!("{what}: roots off it (m)"), off, 1e-4),
            Row::new(format!("{what}: longest strand (m)"), scale * LONG, length, 1e-3),
            Row::at_most(format!("{what}: joints bent by (rad)"), bent, 0.01),
            Row::at_most(format!("{what}: faults"), faults, 0.0),
        ]);
    }
    for (what, touch) in [("control, shaved", false), ("shaved, roots touched", true)] {
        let [off, faults] = shaved(touch);
        rows.extend([
            Row::at_most(format!("{what}: roots off (m)"), off, 1e-4),
            Row::at_most(format!("{what}: faults"), faults, 0.0),
        ]);
    }
    rows
}

/// How much the original differs from one that was never copied, in bits: 0, or 1 for any difference.
fn original_differs(copied: Copied) -> f32 {
    let hair_after = |copied| {
        let mut own = pair(copied, false);
        run(&mut own.app, 0.3);
        let hair = hair_of(&mut own.app, own.wearers[0])[0];
        let strands = strands_of(&own.app, hair);
        let nodes = strands.iter().flat_map(|strand| strand.positions().to_vec());
        nodes.map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>()
    };
    f32::from(u8::from(hair_after(Copied::No) != hair_after(copied)))
}

/// What is left when the copy takes its hair off, at once or later: hairs of the original and of the copy, and the
/// share of colliders.
fn taken_off(copied: Copied, wait: f64) -> [f32; 3] {
    let mut own = pair(copied, wait > 0.0);
    run(&mut own.app, wait);
    let before = count::<HairCollider>(&mut own.app);
    own.app.world_mut().entity_mut(own.wearers[1]).remove::<WearHair>();
    own.app.update();
    let wearers = own.wearers.clone();
    let hairs: Vec<usize> =
        wearers.into_iter().map(|wearer| hair_of(&mut own.app, wearer).len()).collect();
    let after = count::<HairCollider>(&mut own.app);
    let share = if before > 0 { after as f32 / before as f32 } else { 0.5 };
    [hairs[0] as f32, hairs[1] as f32, share]
}

/// Lines 11 and 14: characters that are cloned, or loaded from a scene beside them.
pub fn copies() -> Vec<Row> {
    let mut rows = Vec::new();
    for copied in [Copied::Cloned, Copied::Loaded] {
        let what = format!("{copied:?} character");
        let (hairs, colliders) = hairs_and_colliders(copied);
        let [at_once, walked] = roots_of_copy(copied);
        rows.extend([
            Row::new(format!("{what}: hairs of the original"), 1.0, hairs[0] as f32, 0.0),
            Row::new(format!("{what}: hairs of the copy"), 1.0, hairs[1] as f32, 0.0),
            Row::new(format!("{what}: times the colliders of one"), 2.0, colliders, 0.0),
            Row::at_most(format!("{what}: roots off its head (m)"), at_once, 1e-4),
            Row::at_most(format!("{what}: roots off its head when it walks (m)"), walked, 1e-4),
            Row::at_most(format!("{what}: hairdo off the original's"), style_of_copy(copied), 0.0),
            Row::at_most(format!("{what}: original changed"), original_differs(copied), 0.0),
        ]);
        for (when, wait) in [("at once", 0.0), ("later", 0.2)] {
            let [original, copy, share] = taken_off(copied, wait);
            rows.extend([
                Row::new(format!("{what}, off {when}: hairs of the original"), 1.0, original, 0.0),
                Row::new(format!("{what}, off {when}: hairs of the copy"), 0.0, copy, 0.0),
                Row::new(format!("{what}, off {when}: share of colliders left"), 0.5, share, 0.0),
            ]);
        }
    }
    let [cloned, removed] = strands_of_cloned_groom();
    for (what, counts, expected) in
        [("groom cloned", cloned, [20, 20]), ("clone's groom removed", removed, [20, 0])]
    {
        for (which, i) in [("original", 0), ("copy", 1)] {
            let [expected, got] = [expected[i] as f32, counts[i] as f32];
            rows.push(Row::new(format!("{what}: strands of the {which}"), expected, got, 0.0));
        }
    }
    rows
}

/// Line 13: meshes whose vertices are edited, or that are replaced.
pub fn edits() -> Vec<Row> {
    let mut rows = Vec::new();
    for edit in [Edit::Not, Edit::Vertices, Edit::Mesh3d] {
        let [off, length, faults] = edited(edit);
        let (grown, is_new) = worn_on_edited_head(edit);
        let what = match edit {
            Edit::Not => "control, mesh as it was",
            Edit::Vertices => "vertices edited",
            Edit::Mesh3d => "Mesh3d replaced",
        };
        let by = if edit == Edit::Not { 1.0 } else { 1.3 };
        rows.extend([
            Row::at_most(format!("{what}: roots off the skin (m)"), off, 1e-4),
            Row::new(format!("{what}: longest strand (m)"), LONG, length, 1e-3),
            Row::at_most(format!("{what}: faults"), faults, 0.0),
            Row::new(format!("{what}: reach of worn colliders"), by, grown[0], 0.03),
            Row::new(format!("{what}: distance of worn roots"), by, grown[1], 0.03),
            Row::at_most(format!("{what}: worn anew"), f32::from(u8::from(is_new)), 0.0),
        ]);
    }
    rows.push(Row::at_most(
        "mesh edited in each frame: drawn roots off it, a frame ago (m)",
        drawn_off_pulsing_mesh(),
        1e-4,
    ));
    rows.extend(other_triangles());
    rows.extend(worn_on_other_triangles());
    rows
}

/// Line 13: a mesh of other triangles: roots stay on the mesh as it was, which is reported once, until they get
/// roots on this one.
fn other_triangles() -> Vec<Row> {
    let mut own = groomed(1.0);
    let other = Sphere::new(1.2 * HEAD).mesh().uv(30, 20);
    let handle = own.app.world_mut().resource_mut::<Assets<Mesh>>().add(other.clone());
    own.app.world_mut().entity_mut(own.body).insert(Mesh3d(handle));
    run(&mut own.app, 0.3);
    let faults = fault_count(&own.app);
    let kept = off_skin(&own, 1, |p| place(1.0).transform_point(p));
    let places = own.planted.groom.strands().map(|strand| strand.points[0]);
    let nearest = RootOnMesh::nearest(&other, places).unwrap();
    let mut roots = own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap();
    roots.roots = nearest.into_iter().map(|(root, _)| root).collect();
    run(&mut own.app, 0.3);
    let frame = *own.app.world().get::<Transform>(own.hair).unwrap();
    let mut off = 0.0_f32;
    for strand in strands_of(&own.app, own.hair) {
        let root = frame.transform_point(strand.positions()[0]);
        let at = place(1.0).to_matrix().inverse().transform_point3(root);
        off = off.max((at.length() - 1.2 * HEAD).abs());
    }
    vec![
        Row::new("other triangles: faults", 1.0, faults, 0.0),
        Row::at_most("other triangles: roots off the mesh as it was (m)", kept, 1e-4),
        Row::at_most("other triangles, new roots: off the mesh (m)", off, 2e-3),
        Row::new(
            "other triangles, new roots: longest (m)",
            LONG,
            longest(&own.app, own.hair),
            1e-3,
        ),
        Row::new("other triangles, new roots: faults", 1.0, fault_count(&own.app), 0.0),
    ]
}

/// Line 13: worn hair is made again on a head of other triangles.
fn worn_on_other_triangles() -> Vec<Row> {
    let mut app = app_with_meshes();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1));
    let wear = WearHair::new(short_groom(&mut app, Vec3::ZERO, Vec3::splat(0.1)));
    let head = app.world_mut().spawn((Mesh3d(mesh), Transform::default(), wear)).id();
    let hair = worn(&mut app, head);
    run(&mut app, 0.1);
    let other = Sphere::new(0.1).mesh().uv(40, 30);
    let other = app.world_mut().resource_mut::<Assets<Mesh>>().add(other);
    app.world_mut().get_mut::<Mesh3d>(head).unwrap().0 = other;
    for _ in 0..4000 {
        app.update();
        sleep(Duration::from_millis(1));
        if hair_of(&mut app, head).iter().any(|other| *other != hair) {
            break;
        }
    }
    run(&mut app, 0.1);
    let hairs = hair_of(&mut app, head);
    let is_new = hairs.len() == 1 && hairs[0] != hair;
    let roots = hairs.iter().flat_map(|hair| roots_in_world(&app, *hair)).collect::<Vec<_>>();
    let off = roots.iter().map(|root| (root.length() - 0.1).abs()).fold(0.0, f32::max);
    vec![
        Row::new("worn on other triangles: made again", 1.0, f32::from(u8::from(is_new)), 0.0),
        Row::at_most("worn on other triangles: roots off the mesh (m)", off, 2e-3),
        Row::at_most("worn on other triangles: faults", fault_count(&app), 0.0),
    ]
}
