//! Tying strands to their mesh once it is loaded, and again whenever mesh or roots change.
//!
//! A strand is planted once: taken from its bound triangle to the posed one. Its [`PlantedRoot`] stays, and
//! everything else is derived from that, however often.

use super::{
    bones::{RootsOnBones, SEARCH_TIME, SEARCHES, Skeletons, on_bones},
    corner::{Corner, Corners, Triangles},
    error::RootsError,
    morph::Morphs,
    pose::{MeshPose, Movers},
    roots::{MadeAgain, PlantedRoot, RootsOnMesh, Tied, TiedRoots, triangle},
};
use crate::{
    authoring::plant::RootOnMesh,
    base::{
        fault::{FaultKind, HairFault},
        schedule::HairStep,
    },
    hair::strand::{HairHere, MIN_SEGMENT, Pose, Strand, StrandHistory, Strands, TickPose},
};
use bevy::{
    ecs::{entity::EntityHashMap, system::SystemParam},
    math::{Affine3A, Isometry3d},
    mesh::{
        Mesh, Mesh3d,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    platform::collections::{HashMap, HashSet},
    prelude::*,
};
use core::mem::replace;

/// How far (m) and by how much (rad) a root that was planted may be from its place on the mesh, and its strand
/// stays as it is.
const STAYS: f32 = 5e-5;
const STAYS_TURNED: f32 = 1e-3;

/// Meshes with their skins.
#[derive(SystemParam)]
pub(super) struct Skins<'w, 's> {
    meshes: Option<Res<'w, Assets<Mesh>>>,
    bindposes: Option<Res<'w, Assets<SkinnedMeshInverseBindposes>>>,
    skins: Query<'w, 's, (&'static Mesh3d, Option<&'static SkinnedMesh>)>,
}

type Skin<'a> = Option<(&'a SkinnedMesh, &'a SkinnedMeshInverseBindposes)>;

impl Skins<'_, '_> {
    /// Each of several meshes with its skin; `None` while an asset is missing.
    fn all(
        &self,
        entities: impl Iterator<Item = Entity>,
    ) -> Option<Vec<(Entity, (&Mesh, Skin<'_>))>> {
        entities.map(|entity| Some((entity, self.get(entity)?))).collect()
    }

    /// A mesh with its skin; `None` while an asset is missing.
    fn get(&self, entity: Entity) -> Option<(&Mesh, Skin<'_>)> {
        let (mesh, skin) = self.skins.get(entity).ok()?;
        let mesh = self.meshes.as_ref()?.get(&mesh.0)?;
        let Some(skin) = skin else { return Some((mesh, None)) };
        Some((mesh, Some((skin, self.bindposes.as_ref()?.get(&skin.inverse_bindposes)?))))
    }
}

/// What moves the corners of some roots, the corners, and the triangles of their mesh.
type Read = (Movers, Vec<[Corner; 3]>, Triangles);

fn read<'a, 'm>(
    meshes: impl IntoIterator<Item = (Entity, (&'m Mesh, Skin<'m>))>,
    roots: impl Iterator<Item = &'a RootOnMesh>,
    known: Option<Triangles>,
) -> Result<Read, RootsError> {
    let (mut movers, mut corners) = (Movers::default(), Corners::new());
    for (entity, (mesh, skin)) in meshes {
        let joints = movers.add(entity, skin)?;
        corners.add(mesh, skin.is_some(), joints)?;
    }
    let triangles = corners.triangles();
    if let Some(known) = known.filter(|known| *known != triangles) {
        let (found, expected) = (triangles.vertices, known.vertices);
        return Err(RootsError::Triangles { found, expected });
    }
    let read = roots.map(|root| corners.around(root, &mut movers.shifts));
    let read = read.collect::<Result<_, _>>()?;
    Ok((movers, read, triangles))
}

/// Ties the strands of new or changed [`RootsOnMesh`].
pub(super) fn tie(
    step: Res<HairStep>,
    mut commands: Commands,
    skins: Skins,
    transforms: TransformHelper,
    morphs: Morphs,
    mut hairs: Query<(Entity, Ref<RootsOnMesh>, &mut TiedRoots, &Strands, &TickPose), HairHere>,
    mut strands: Query<Rooted>,
    mut faults: MessageWriter<HairFault>,
) {
    if step.index != 0 {
        return;
    }
    for (hair, roots, mut tied, members, pose) in &mut hairs {
        if roots.is_changed() {
            tied.done = false;
        }
        if tied.done {
            continue;
        }
        if roots.mesh.is_none() {
            tied.roots.clear();
            continue;
        }
        let Some(meshes) = skins.all(roots.meshes().map(|(mesh, _)| mesh)) else { continue };
        let mut report = |why| {
            faults.write(
                HairFault::caused(FaultKind::Roots, why, "those strands do not follow the mesh")
                    .of(hair),
            )
        };
        let planted = members.iter().map(|id| strands.get(id).ok().and_then(|s| s.2).copied());
        let planted: Vec<Option<PlantedRoot>> = planted.collect();
        // Other roots may be on other triangles.
        let is_known =
            roots.meshes().map(|(mesh, _)| mesh).eq(tied.movers.meshes().iter().copied());
        let chosen = assigned(&planted, &roots.roots);
        let is_same = |(root, planted): (&RootOnMesh, &Option<PlantedRoot>)| {
            planted.as_ref().is_some_and(|planted| planted.root == *root)
        };
        let read = chosen.and_then(|chosen| {
            let same = is_known && chosen.iter().zip(&planted).all(is_same);
            let known = tied.triangles.filter(|_| same);
            let (movers, corners, triangles) = read(meshes, chosen.iter(), known)?;
            Ok((chosen, movers, corners, triangles))
        });
        let (chosen, movers, corners, triangles) = match read {
            Ok(read) => read,
            Err(why) => {
                tied.done = true;
                report(why);
                continue;
            }
        };
        let place = |entity| transforms.compute_global_transform(entity).ok();
        let Some(posed) = movers.pose(place, &morphs) else { continue };
        let from_mesh: Vec<Affine3A> = roots.meshes().map(|(_, from_mesh)| from_mesh).collect();
        let is_new_mesh = !tied.movers.meshes().is_empty() && !is_known;
        let puts = Puts {
            bind: |corner: &Corner| from_mesh[usize::from(corner.part)].transform_point3(corner.at),
            posed: &posed,
            pose: pose.now(),
            is_new_mesh,
            aims: tied.aims(is_known),
        };
        let each = members.iter().zip(chosen.into_iter().zip(corners)).zip(planted);
        let (made, flat) = puts.all(each, &mut strands, &mut commands);
        *tied =
            TiedRoots { roots: made, movers, triangles: Some(triangles), done: true, ..default() };
        if flat > 0 {
            report(RootsError::Flat { found: flat });
        }
    }
}

/// Ties the strands of new or changed [`RootsOnBones`], once their bones are there.
pub(super) fn tie_to_bones(
    step: Res<HairStep>,
    mut commands: Commands,
    skeletons: Skeletons,
    transforms: TransformHelper,
    morphs: Morphs,
    mut hairs: Query<
        (Entity, &mut RootsOnBones, &mut TiedRoots, &Strands),
        (HairHere, Without<RootsOnMesh>),
    >,
    mut strands: Query<Rooted>,
    mut faults: MessageWriter<HairFault>,
) {
    if step.index != 0 {
        return;
    }
    for (hair, mut roots, mut tied, members) in &mut hairs {
        if roots.is_changed() {
            (tied.done, tied.searched) = (false, 0.0);
        }
        if tied.done {
            continue;
        }
        let before = tied.searched;
        tied.searched += step.dt * step.count as f32;
        let searches = |seconds: f32| (SEARCHES * seconds) as u32;
        if before > 0.0 && searches(before) == searches(tied.searched) {
            continue;
        }
        let found = skeletons.search(hair, &roots);
        if !found.missing.is_empty() && tied.searched < SEARCH_TIME {
            continue;
        }
        // Where all of them are at the end of the tick: a hair that moves is elsewhere now.
        let place = |entity| transforms.compute_global_transform(entity).ok();
        let Some(pose) = place(hair).as_ref().and_then(Pose::of) else { continue };
        let roots = roots.bypass_change_detection();
        let (movers, joints) = found.movers(&mut roots.rest, &pose, place);
        let Some(posed) = movers.pose(place, &morphs) else { continue };
        let mut report = |why| {
            faults.write(
                HairFault::caused(FaultKind::Roots, why, "strands follow the bones that are there")
                    .of(hair),
            )
        };
        if !found.missing.is_empty() {
            report(found.error());
        }
        let planted = members.iter().map(|id| strands.get(id).ok().and_then(|s| s.2).copied());
        let planted: Vec<Option<PlantedRoot>> = planted.collect();
        let count = roots.roots.len().min(roots.bones.strands.len());
        // The number of a root in place of its triangle.
        let numbered = |i| RootOnMesh { vertices: [i; 3], weights: Vec3::X };
        let keys: Vec<RootOnMesh> = (0..count as u32).map(numbered).collect();
        let chosen = match assigned(&planted, &keys) {
            Ok(chosen) => chosen,
            Err(why) => {
                tied.done = true;
                report(why);
                continue;
            }
        };
        let puts = Puts {
            bind: |corner: &Corner| corner.at,
            posed: &posed,
            pose: &pose,
            is_new_mesh: false,
            aims: tied.aims(tied.movers.bones().eq(movers.bones())),
        };
        let corners = chosen.into_iter().map(|root| {
            let i = root.vertices[0] as usize;
            Some((root, on_bones(roots.roots[i], &roots.bones.strands[i], &joints)?))
        });
        let bound = members.iter().zip(corners).zip(planted);
        let each = bound.filter_map(|((id, corners), planted)| Some(((id, corners?), planted)));
        let (made, flat) = puts.all(each, &mut strands, &mut commands);
        *tied = TiedRoots { roots: made, movers, done: true, ..default() };
        if flat > 0 {
            report(RootsError::Flat { found: flat });
        }
    }
}

/// What a strand has to be tied.
type Rooted = (&'static mut Strand, &'static mut StrandHistory, Option<&'static PlantedRoot>);

/// How strands are put in their places.
struct Puts<'a, B> {
    /// Where a corner is before it is posed.
    bind: B,
    posed: &'a MeshPose<'a>,
    pose: &'a Pose,
    is_new_mesh: bool,
    /// Roots that are on their way.
    aims: EntityHashMap<Isometry3d>,
}

impl<B: Fn(&Corner) -> Vec3> Puts<'_, B> {
    /// Puts each strand in its place. Returns those tied, and how many cannot be.
    fn all(
        &self,
        each: impl Iterator<Item = ((Entity, (RootOnMesh, [Corner; 3])), Option<PlantedRoot>)>,
        strands: &mut Query<Rooted>,
        commands: &mut Commands,
    ) -> (Vec<Tied>, usize) {
        let (mut made, mut flat) = (Vec::new(), 0);
        for ((member, (root, corners)), planted) in each {
            let Ok((mut strand, mut history, _)) = strands.get_mut(member) else { continue };
            let seen = |at| self.pose.point_in(at);
            let place = Place {
                root,
                bind: corners.map(|c| (self.bind)(&c)),
                posed: corners.map(|c| seen(self.posed.corner(&c))),
                unmorphed: corners.map(|c| seen(self.posed.unmorphed(&c))),
            };
            let found = match planted {
                None => plant(&place, &mut strand, &mut history),
                Some(planted) => {
                    let aim = self.aims.get(&member).filter(|_| planted.root == root);
                    put(&place, planted, self.is_new_mesh, aim, &mut strand, &mut history)
                }
            };
            let Some((is, at)) = found else {
                flat += 1;
                continue;
            };
            if planted != Some(is) {
                commands.entity(member).try_insert(is);
            }
            let offset = is.offset();
            made.push(Tied { strand: member, root, corners, offset, from: at, to: at });
        }
        (made, flat)
    }
}

/// The root of each strand. Those that were planted keep theirs if it is among the `roots`; the others get what
/// is left, in order.
fn assigned(
    planted: &[Option<PlantedRoot>],
    roots: &[RootOnMesh],
) -> Result<Vec<RootOnMesh>, RootsError> {
    type Key = ([u32; 3], [u32; 3]);
    let key =
        |root: &RootOnMesh| -> Key { (root.vertices, root.weights.to_array().map(f32::to_bits)) };
    let mut left: HashMap<Key, usize> = default();
    roots.iter().for_each(|root| *left.entry(key(root)).or_default() += 1);
    let kept: Vec<Option<RootOnMesh>> = planted
        .iter()
        .map(|planted| {
            let root = planted.as_ref()?.root;
            let left = left.get_mut(&key(&root)).filter(|left| **left > 0)?;
            *left -= 1;
            Some(root)
        })
        .collect();
    let mut others = roots.iter().filter(|root| {
        let Some(left) = left.get_mut(&key(root)).filter(|left| **left > 0) else { return false };
        *left -= 1;
        true
    });
    let count = RootsError::Count { found: roots.len(), expected: planted.len() };
    // New strands have a root each, and no root is without one.
    if planted.iter().all(Option::is_none) && planted.len() != roots.len() {
        return Err(count);
    }
    let all = kept.into_iter().map(|kept| kept.or_else(|| others.next().copied()));
    all.collect::<Option<_>>().ok_or(count)
}

/// Where a root is: its triangle in the strands' space, and as posed in the hair's frame, morphed and not.
struct Place {
    root: RootOnMesh,
    bind: [Vec3; 3],
    posed: [Vec3; 3],
    unmorphed: [Vec3; 3],
}

impl Place {
    /// The frames of both triangles; `None` where one has no area.
    fn frames(&self) -> Option<[Isometry3d; 2]> {
        let frame = |corners| triangle(corners, self.root.weights);
        Some([frame(self.bind)?, frame(self.posed)?])
    }

    /// The factor on lengths. Morph targets move and rotate a strand, but do not scale it: lengths are those of
    /// the unmorphed mesh, whatever the face's expression.
    fn scale(&self) -> f32 {
        let size = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length().sqrt();
        size(self.unmorphed) / size(self.bind)
    }
}

/// Moves a strand from its triangle as bound to that as posed.
fn plant(
    place: &Place,
    strand: &mut Mut<'_, Strand>,
    history: &mut Mut<'_, StrandHistory>,
) -> Option<(PlantedRoot, Isometry3d)> {
    let [bind, now] = place.frames()?;
    let scale = place.scale();
    let at = transform_strand(strand, history, &bind, &now, scale)?;
    let offset = now.inverse() * at;
    let planted = PlantedRoot {
        root: place.root,
        place: offset.translation.into(),
        frame: offset.rotation,
        bind: bind.rotation,
        scale,
    };
    Some((planted, at))
}

/// Puts a strand that was planted in its place; one whose root already has this mesh as its `aim` stays.
fn put(
    place: &Place,
    mut planted: PlantedRoot,
    is_new_mesh: bool,
    aim: Option<&Isometry3d>,
    strand: &mut Mut<'_, Strand>,
    history: &mut Mut<'_, StrandHistory>,
) -> Option<(PlantedRoot, Isometry3d)> {
    let [bind, now] = place.frames()?;
    if planted.root != place.root {
        // The same direction in the strands' space.
        planted.frame = (bind.rotation.inverse() * (planted.bind * planted.frame)).normalize();
        (planted.root, planted.bind) = (place.root, bind.rotation);
    }
    let mut larger = 1.0;
    if is_new_mesh {
        larger = place.scale() / planted.scale;
        planted.scale *= larger;
        planted.place *= larger;
    }
    let root = Isometry3d::new(strand.positions()[0], strand.root_frame());
    let at = now * planted.offset();
    let is_there = Vec3::from(root.translation).distance(at.translation.into()) < STAYS
        && root.rotation.angle_between(at.rotation) < STAYS_TURNED
        && larger == 1.0;
    if aim.is_some() || is_there {
        return Some((planted, *aim.unwrap_or(&root)));
    }
    Some((planted, transform_strand(strand, history, &root, &at, larger)?))
}

/// Moves, rotates and scales a strand as a whole: its shape and the shapes that its bonds remember stay the
/// same. Returns place and frame of its root; `None` where it cannot be.
fn transform_strand(
    strand: &mut Mut<'_, Strand>,
    history: &mut Mut<'_, StrandHistory>,
    from: &Isometry3d,
    to: &Isometry3d,
    scale: f32,
) -> Option<Isometry3d> {
    let turn = to.rotation * from.rotation.inverse();
    let turned = |q: &Quat| (turn * *q).normalize();
    let (positions, velocities, orientations, spins) = strand.parts();
    let place = |p: &Vec3| *to * ((from.inverse() * *p) * scale);
    let positions: Vec<Vec3> = positions.iter().map(place).collect();
    let lengths: Vec<f32> = strand.rest_lengths().iter().map(|l| l * scale).collect();
    let usable = positions.len() >= 2
        && positions.iter().all(|p| p.is_finite())
        && lengths.iter().all(|l| *l >= MIN_SEGMENT);
    if !usable {
        return None;
    }
    let orientations = orientations.iter().map(turned).collect();
    let moving = |all: &[Vec3]| all.iter().map(|v| turn * *v).collect::<Vec<_>>();
    let (velocities, spins) = (moving(velocities), moving(spins));
    let at = Isometry3d::new(positions[0], turned(&strand.root_frame()));
    strand.replace(positions, orientations, lengths, at.rotation);
    let (_, own, _, own_spins) = strand.parts_mut();
    own.copy_from_slice(&velocities);
    own_spins.copy_from_slice(&spins);
    **history = default();
    Some(at)
}

/// Once a frame: reads the vertices of meshes that were edited or replaced again.
pub(super) fn follow_edits(
    skins: Skins,
    mut edits: Option<MessageReader<AssetEvent<Mesh>>>,
    replaced: Query<Entity, Or<(Changed<Mesh3d>, Changed<SkinnedMesh>)>>,
    drawn: Query<&Mesh3d>,
    mut hairs: Query<(Entity, &mut TiedRoots, Has<MadeAgain>)>,
    mut faults: MessageWriter<HairFault>,
) {
    let edits = edits.iter_mut().flat_map(|edits| edits.read());
    let edited: HashSet<AssetId<Mesh>> = edits
        .filter_map(|event| match event {
            AssetEvent::Modified { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (hair, mut tied, is_made_again) in &mut hairs {
        let tied = tied.bypass_change_detection();
        let has_changed = |mesh: &Entity| {
            replaced.contains(*mesh)
                || !edited.is_empty()
                    && drawn.get(*mesh).is_ok_and(|mesh| edited.contains(&mesh.id()))
        };
        tied.stale |= tied.movers.meshes().iter().any(has_changed);
        if !tied.stale {
            continue;
        }
        let meshes = skins.all(tied.movers.meshes().iter().copied());
        let Some(meshes) = meshes.filter(|meshes| !meshes.is_empty()) else { continue };
        tied.stale = false;
        let roots = tied.roots.iter().map(|tied| &tied.root);
        match read(meshes, roots, tied.triangles) {
            Ok((movers, corners, triangles)) => {
                (tied.movers, tied.triangles, tied.lost) = (movers, Some(triangles), false);
                tied.roots.iter_mut().zip(corners).for_each(|(tied, now)| tied.corners = now);
            }
            // Reported once, until it fits again.
            Err(why) => {
                let is_new = !replace(&mut tied.lost, true);
                if is_new && !is_made_again {
                    let outcome = "the strands follow the mesh as it was";
                    faults.write(HairFault::caused(FaultKind::Roots, why, outcome).of(hair));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planted_strands_keep_their_roots_and_new_ones_get_what_is_left() {
        let root = |v: u32| RootOnMesh { vertices: [v, v + 1, v + 2], weights: Vec3::X };
        let is = |v: u32| Some(PlantedRoot { root: root(v), ..default() });
        let all = [0, 1, 2, 3].map(root);
        let of = |planted: &[Option<PlantedRoot>]| {
            let found = assigned(planted, &all).ok()?;
            Some(found.iter().map(|root| root.vertices[0]).collect::<Vec<_>>())
        };
        assert_eq!(of(&[None; 4]), Some(vec![0, 1, 2, 3]));
        assert_eq!(of(&[None; 3]), None, "new strands have a root each");
        assert_eq!(of(&[is(1), is(3)]), Some(vec![1, 3]), "shaved");
        assert_eq!(of(&[is(1), is(3), None, None]), Some(vec![1, 3, 0, 2]), "and grown again");
        assert_eq!(of(&[is(1), is(3), None, None, None]), None);
        assert_eq!(of(&[is(7), is(8), is(9), is(10)]), Some(vec![0, 1, 2, 3]), "other roots");
    }
}
