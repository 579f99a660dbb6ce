//! Roots that follow the bones of a skeleton, found by their names.

use super::{corner::Corner, error::RootsError, pose::Movers};
use crate::{
    authoring::groom::{RootBones, StrandBones},
    hair::strand::Pose,
};
use bevy::{
    ecs::system::SystemParam,
    math::Affine3A,
    mesh::skinning::SkinnedMesh,
    platform::collections::{HashMap, HashSet},
    prelude::*,
};

/// Ties the roots of a [`Hair`](crate::Hair)'s strands to bones that are entities with a `Name`: each follows up
/// to four, blended linearly as a skin is. Component of the hair, inserted by
/// [`GroomedHair`](crate::authoring::groom::GroomedHair) where its groom has bones, as a TressFX groom with a
/// `.tfxbone`. Beside a [`RootsOnMesh`](super::RootsOnMesh) it does nothing.
///
/// Where the hair is when it is first tied is where it belongs on the bones as they are at that moment: let that be
/// the pose that the groom was made for, with the hair's entity where the groom's origin is, such as the
/// character's own. From then on roots move, rotate and scale with their bones; in new strands too, because
/// [`rest`](Self::rest) remembers that pose. Roots that no bone moves stay with the hair.
///
/// Bones that are not there after ten seconds are reported once as [`FaultKind::Roots`](crate::FaultKind::Roots), and
/// strands follow the others. Writing to this component searches again.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct RootsOnBones {
    /// The entity below which the bones are, itself included. Default `None`: the nearest above the hair, itself
    /// included, that has all of them, or else most.
    #[entities]
    pub skeleton: Option<Entity>,
    /// Which bones move each strand, in the order of the hair's [`Strands`](crate::Strands).
    pub bones: RootBones,
    /// Where the root of each strand is at rest, in the hair's frame (m).
    pub roots: Vec<Vec3>,
    /// The transform from each bone to the hair's frame at rest. Default empty; what is missing is measured when
    /// the roots are tied.
    pub rest: Vec<Option<Affine3A>>,
}

impl RootsOnBones {
    /// With the pose at rest that the same bones had before.
    pub(crate) fn at_rest_as(mut self, before: Option<&Self>) -> Self {
        if let Some(before) = before.filter(|before| before.bones.names == self.bones.names) {
            (self.skeleton, self.rest) = (before.skeleton, before.rest.clone());
        }
        self
    }

    /// Each bone that moves a root.
    fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.bones.names.len()];
        for (bone, _) in self.bones.strands.iter().flat_map(|strand| strand.used()) {
            used.get_mut(usize::from(bone)).into_iter().for_each(|used| *used = true);
        }
        used
    }
}

/// How long bones are searched before those that are missing are reported (s).
pub(super) const SEARCH_TIME: f32 = 10.0;
/// How often (1/s): a walk through all that is below each entity above the hair.
pub(super) const SEARCHES: f32 = 4.0;

/// The corners of a triangle around a root, which its bones move by their indices among the joints; `None` where
/// none of them is there.
pub(super) fn on_bones(
    root: Vec3,
    bones: &StrandBones,
    joints: &[Option<u16>],
) -> Option<[Corner; 3]> {
    let (mut own, mut weights) = ([0; 4], [0.0; 4]);
    let there = bones
        .used()
        .filter_map(|(bone, weight)| Some((joints.get(usize::from(bone)).copied()??, weight)));
    for (slot, (joint, weight)) in there.enumerate() {
        (own[slot], weights[slot]) = (joint, weight);
    }
    let sum = Some(weights.iter().sum::<f32>()).filter(|sum| *sum > 0.0 && sum.is_finite())?;
    let weights = weights.map(|weight| weight / sum);
    // As large as a metre, so that rounding far from the origin does not turn it.
    Some([Vec3::ZERO, Vec3::X, Vec3::Y].map(|by| Corner::on_joints(root + by, own, weights)))
}

/// Bones that were searched by their names.
#[derive(Default)]
pub(super) struct Found {
    /// Of each name.
    bones: Vec<Option<Entity>>,
    /// Names that are nowhere.
    pub missing: Vec<String>,
    /// How many entities with a name were looked at.
    named: usize,
}

impl Found {
    /// Those that are not there.
    pub fn error(&self) -> RootsError {
        let (missing, named) = (self.missing.join(", "), self.named);
        RootsError::NoBones { missing, named }
    }

    /// The bones as what moves roots, and for each name its index among them. Poses at rest that are not known are
    /// measured now.
    pub fn movers(
        &self,
        rest: &mut Vec<Option<Affine3A>>,
        hair: &Pose,
        mut place: impl FnMut(Entity) -> Option<GlobalTransform>,
    ) -> (Movers, Vec<Option<u16>>) {
        let (mut movers, to_hair) = (Movers::default(), hair.affine().inverse());
        rest.resize(self.bones.len(), None);
        let mut joint = |(bone, rest): (&Option<Entity>, &mut Option<Affine3A>)| {
            let bone = (*bone)?;
            let at = rest.or_else(|| Some(to_hair * place(bone)?.affine()))?;
            // A bone that is scaled to nothing moves nothing.
            let inverse = Some(at.inverse()).filter(Affine3A::is_finite)?;
            *rest = Some(at);
            Some(movers.add_bone(bone, inverse))
        };
        let joints = self.bones.iter().zip(rest).map(&mut joint).collect();
        (movers, joints)
    }
}

/// The entities of a skeleton.
#[derive(SystemParam)]
pub(super) struct Skeletons<'w, 's> {
    names: Query<'w, 's, &'static Name>,
    children: Query<'w, 's, &'static Children>,
    parents: Query<'w, 's, &'static ChildOf>,
    skins: Query<'w, 's, &'static SkinnedMesh>,
}

impl Skeletons<'_, '_> {
    /// The bones that move a hair's roots.
    pub fn search(&self, hair: Entity, roots: &RootsOnBones) -> Found {
        let used = roots.used();
        let above = roots.skeleton.is_none().then(|| self.parents.iter_ancestors(hair));
        let start = roots.skeleton.unwrap_or(hair);
        let mut best: Option<Found> = None;
        for root in core::iter::once(start).chain(above.into_iter().flatten()) {
            let found = self.below(root, &roots.bones.names, &used);
            let is_all = found.missing.is_empty();
            if best.as_ref().is_none_or(|best| found.missing.len() < best.missing.len()) {
                best = Some(found);
            }
            if is_all {
                break;
            }
        }
        best.unwrap_or_default()
    }

    /// Those at or below an entity. Joints of a skin come before other entities of their name, and that name before
    /// one that differs by a namespace.
    fn below(&self, root: Entity, names: &[String], used: &[bool]) -> Found {
        let joints: HashSet<Entity> =
            self.skins.iter().flat_map(|skin| skin.joints.iter().copied()).collect();
        let all = core::iter::once(root).chain(self.children.iter_descendants(root));
        let named = all.filter_map(|entity| Some((entity, self.names.get(entity).ok()?.as_str())));
        let mut named: Vec<(Entity, &str)> = named.collect();
        named.sort_by_key(|(entity, _)| !joints.contains(entity));
        let (mut exact, mut alike) = (HashMap::new(), HashMap::new());
        for &(entity, name) in &named {
            exact.entry(name).or_insert(entity);
            alike.entry(plain(name)).or_insert(entity);
        }
        let mut found = Found { named: named.len(), ..default() };
        for (name, used) in names.iter().zip(used) {
            let bone = exact.get(name.as_str()).or_else(|| alike.get(plain(name))).copied();
            if *used && bone.is_none() {
                found.missing.push(format!("{name:?}"));
            }
            found.bones.push(bone.filter(|_| *used));
        }
        found
    }
}

/// A name without the namespace that Maya and Mixamo put before it.
fn plain(name: &str) -> &str {
    name.rsplit([':', '|']).next().unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        FaultKind, HairFault, HairGravity, HairPlugins,
        authoring::groom::{
            BonesFile, Groom, GroomGuides, GroomSettings, GroomedHair, RootEnd,
            tressfx::tests::{Slots, tfx, tfxbone},
        },
        hair::strand::{Hair, Strand, Strands},
        run_ticks,
    };
    use bevy::{
        asset::{
            LoadState,
            io::{
                AssetSourceBuilder, AssetSourceId,
                memory::{Dir, MemoryAssetReader},
            },
        },
        transform::TransformPlugin,
    };
    use core::f32::consts::{FRAC_PI_2, FRAC_PI_4};
    use std::path::Path;

    const NONE: (i32, f32) = (-1, 0.0);
    const ROOTS: [Vec3; 4] =
        [Vec3::new(0.0, 0.2, 0.0), Vec3::new(0.1, 0.0, 0.02), Vec3::new(0.1, 0.1, 0.0), Vec3::ZERO];
    /// Where the jaw is.
    const JAW: Vec3 = Vec3::new(0.05, 0.1, 0.0);

    fn files() -> (Vec<u8>, Vec<u8>) {
        let strands: [Slots; 4] = [
            [(0, 1.0), NONE, NONE, NONE],
            [(2, 1.0), NONE, NONE, NONE],
            [(2, 3.0), (0, 3.0), NONE, NONE],
            [NONE; 4],
        ];
        let tfx = tfx(4, 4, |i, k| ROOTS[i as usize] + Vec3::Y * (0.03 * k as f32));
        (tfx, tfxbone(&[b"head", b"not used", b"rig:jaw"], &strands))
    }

    fn app() -> App {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin));
        app
    }

    fn ready(app: &mut App) {
        app.add_plugins(HairPlugins::default()).insert_resource(HairGravity(Vec3::ZERO));
        app.finish();
        app.cleanup();
    }

    /// A character with a head and on it a jaw, and a hair on the character.
    fn character(app: &mut App, jaw: &'static str) -> [Entity; 4] {
        let world = app.world_mut();
        let of = Transform::from_xyz(3.0, 1.0, -2.0).with_rotation(Quat::from_rotation_y(0.7));
        let character = world.spawn((of, Name::new("character"))).id();
        let head = (Name::new("head"), Transform::from_xyz(0.0, 0.1, 0.0), ChildOf(character));
        let head = world.spawn(head).id();
        let at = Transform::from_translation(JAW - Vec3::Y * 0.1);
        let jaw = world.spawn((Name::new(jaw), at, ChildOf(head))).id();
        // Another character in another pose.
        world.spawn((Name::new("head"), Transform::default()));
        let hair = world.spawn((Hair, Transform::default(), ChildOf(character))).id();
        [character, head, jaw, hair]
    }

    fn grow(app: &mut App, hair: Entity) {
        let (tfx, bones) = files();
        // Four roots lie on some ball, from which strands would seem to grow the other way.
        let settings = GroomSettings { roots: RootEnd::First, ..default() };
        let groom = Groom::from_file_with_bones(&tfx, &bones, &settings).unwrap().0;
        groom.spawn(&mut app.world_mut().commands(), hair, &GroomGuides::default()).unwrap();
        app.world_mut().flush();
    }

    /// Place and frame of the strands' roots in the hair's frame, in the file's order.
    fn roots(app: &App, hair: Entity) -> Vec<(Vec3, Quat)> {
        let world = app.world();
        let bones = world.get::<RootsOnBones>(hair).unwrap();
        let mut all: Vec<_> =
            world.get::<Strands>(hair).unwrap().iter().zip(&bones.roots).collect();
        let number = |at: &Vec3| ROOTS.iter().position(|root| root.distance(*at) < 1e-5).unwrap();
        all.sort_by_key(|(_, at)| number(at));
        let strand = |id| world.get::<Strand>(id).unwrap();
        all.iter().map(|(id, _)| (strand(*id).positions()[0], strand(*id).root_frame())).collect()
    }

    fn turned(by: Quat) -> [Vec3; 4] {
        let [head, jaw, both, none] = ROOTS;
        let turn = |at: Vec3| JAW + by * (at - JAW);
        [head, turn(jaw), both.midpoint(turn(both)), none]
    }

    fn assert_at(found: &[(Vec3, Quat)], expected: [Vec3; 4]) {
        for (i, ((found, _), expected)) in found.iter().zip(expected).enumerate() {
            assert!(found.distance(expected) < 1e-5, "strand {i}: {found}, expected {expected}");
        }
    }

    #[test]
    fn roots_go_with_the_bones_that_they_name() {
        let mut app = app();
        ready(&mut app);
        let [character, _, jaw, hair] = character(&mut app, "jaw");
        grow(&mut app, hair);
        run_ticks(&mut app, 3);
        let before = roots(&app, hair);
        assert_at(&before, ROOTS);
        let by = Quat::from_rotation_z(FRAC_PI_2);
        app.world_mut().get_mut::<Transform>(jaw).unwrap().rotation = by;
        run_ticks(&mut app, 2);
        let after = roots(&app, hair);
        assert_at(&after, turned(by));
        let half = Quat::from_rotation_z(FRAC_PI_4);
        let turns = [Quat::IDENTITY, by, half, Quat::IDENTITY];
        for (((_, before), (_, after)), turn) in before.iter().zip(&after).zip(turns) {
            assert!((turn * *before).angle_between(*after) < 2e-3);
        }
        // New strands belong there too, and nothing changes when the character walks.
        grow_again(&mut app, hair);
        app.world_mut().get_mut::<Transform>(character).unwrap().translation.x += 0.05;
        run_ticks(&mut app, 2);
        assert_at(&roots(&app, hair), turned(by));
        app.world_mut().get_mut::<Transform>(jaw).unwrap().rotation = Quat::IDENTITY;
        run_ticks(&mut app, 2);
        assert_at(&roots(&app, hair), ROOTS);
    }

    fn grow_again(app: &mut App, hair: Entity) {
        let old: Vec<Entity> = app.world().get::<Strands>(hair).unwrap().iter().collect();
        old.into_iter().for_each(|strand| assert!(app.world_mut().despawn(strand)));
        grow(app, hair);
    }

    #[test]
    fn bones_that_are_missing_are_waited_for_and_then_reported_once() {
        let mut app = app();
        ready(&mut app);
        let [_, head, _, hair] = character(&mut app, "beak");
        grow(&mut app, hair);
        let hz = 1.0 / app.world().resource::<Time<Fixed>>().timestep().as_secs_f32();
        let reports = |app: &mut App, seconds: f32| -> Vec<String> {
            let mut faults = Vec::new();
            for _ in 0..(seconds * hz) as u32 {
                run_ticks(app, 1);
                faults.extend(app.world_mut().resource_mut::<Messages<HairFault>>().drain());
            }
            assert!(faults.iter().all(|fault| fault.kind == FaultKind::Roots));
            faults.into_iter().map(|fault| fault.to_string()).collect()
        };
        assert!(reports(&mut app, SEARCH_TIME - 0.5).is_empty());
        let faults = reports(&mut app, 2.0);
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].contains(r#"is named "rig:jaw""#), "{faults:?}");
        app.world_mut().get_mut::<Transform>(head).unwrap().translation.y += 0.01;
        run_ticks(&mut app, 2);
        let up = |i: usize| ROOTS[i] + Vec3::Y * 0.01;
        assert_at(&roots(&app, hair), [up(0), ROOTS[1], up(2), ROOTS[3]]);
    }

    #[test]
    fn the_file_beside_a_groom_is_found_and_one_that_is_named() {
        let dir = Dir::default();
        let (tfx, bones) = files();
        let add = |path: &str, bytes: &[u8]| dir.insert_asset(Path::new(path), bytes.to_vec());
        add("a/bob.tfx", &tfx);
        add("a/bob.tfxbone", &bones);
        for alone in ["a/alone.tfx", "a/named.tfx", "a/other.tfx", "a/unused.tfx", "a/broken.tfx"] {
            add(alone, &tfx);
        }
        add("a/unused.tfxbone", &bones[..30]);
        add("a/broken.tfxbone", &bones[..30]);
        let mut app = app();
        let reader = move || Box::new(MemoryAssetReader { root: dir.clone() }) as _;
        app.register_asset_source(AssetSourceId::Default, AssetSourceBuilder::new(reader))
            .add_plugins(bevy::asset::AssetPlugin::default());
        ready(&mut app);
        let server = app.world().resource::<AssetServer>().clone();
        let load = |app: &mut App, path: &'static str, bones: BonesFile| {
            let set = move |s: &mut GroomSettings| {
                (s.bones, s.roots) = (bones.clone(), RootEnd::First);
            };
            let handle = server.load_builder().with_settings(set).load::<Groom>(path);
            for _ in 0..5_000 {
                app.update();
                match server.load_state(&handle) {
                    LoadState::Loaded => return Ok(handle),
                    LoadState::Failed(why) => return Err(why.to_string()),
                    _ => std::thread::sleep(core::time::Duration::from_millis(1)),
                }
            }
            panic!("{path} is not loaded");
        };
        let named = |name: &str| BonesFile::Named(name.to_owned());
        for (path, file, has_bones) in [
            ("a/bob.tfx", BonesFile::Beside, true),
            ("a/alone.tfx", BonesFile::Beside, false),
            ("a/named.tfx", named("bob.tfxbone"), true),
            ("a/unused.tfx", BonesFile::Unused, false),
        ] {
            let groom = load(&mut app, path, file).unwrap();
            let grooms = app.world().resource::<Assets<Groom>>();
            assert_eq!(grooms.get(&groom).unwrap().bones().is_some(), has_bones, "{path}");
        }
        let error = load(&mut app, "a/broken.tfx", BonesFile::Beside).unwrap_err();
        assert!(error.contains("the .tfxbone, byte "), "{error}");
        let error = load(&mut app, "a/other.tfx", named("none.tfxbone")).unwrap_err();
        assert!(error.contains("none.tfxbone cannot be read"), "{error}");

        // From the asset to roots that follow; a groom without bones takes them away again.
        let [_, _, jaw, hair] = character(&mut app, "jaw");
        let bob = load(&mut app, "a/bob.tfx", BonesFile::Beside).unwrap();
        app.world_mut().entity_mut(hair).insert(GroomedHair::new(bob));
        run_ticks(&mut app, 4);
        let by = Quat::from_rotation_z(FRAC_PI_2);
        app.world_mut().get_mut::<Transform>(jaw).unwrap().rotation = by;
        run_ticks(&mut app, 2);
        assert_at(&roots(&app, hair), turned(by));
        let alone = load(&mut app, "a/alone.tfx", BonesFile::Beside).unwrap();
        app.world_mut().entity_mut(hair).insert(GroomedHair::new(alone));
        run_ticks(&mut app, 4);
        assert!(app.world().get::<RootsOnBones>(hair).is_none());
    }
}
