//! Hair on characters from glTF files, measured: what it grows on, how far roots are off the skin, how much of the
//! scalp has hair, which way the character was found to look, and how many strands are awake once it stands still.

use super::{gltf::register, rows::Row};
use bevy::{
    gltf::{GltfAssetLabel, GltfPlugin},
    mesh::{
        VertexAttributeValues as Values,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
    time::TimeUpdateStrategy,
    world_serialization::{WorldAssetRoot, WorldSerializationPlugin},
};
use bevy_keratin::{
    authoring::{attach::RootsOnMesh, plant::RootOnMesh},
    prelude::*,
};
use std::{
    path::{Path, PathBuf},
    thread::sleep,
    time::Duration,
};

/// Frames to wait for a file and its hair, of 2 ms at least.
const PATIENCE: u32 = 15_000;
/// Frames in which hair settles, and its character moves.
const FRAMES: u32 = 30;
/// Frames after which a character that stands still has its hair at rest: 5 s.
const REST: u32 = 300;
/// A ball that touches hair at rest (m).
const TOUCH: f32 = 0.03;
/// Directions in which a head is looked at.
const DIRECTIONS: usize = 2000;
/// A place of the scalp has hair where a root is nearer than this, seen from the head's middle.
const NEAR: f32 = 0.2;

/// What happened to a wearer.
#[derive(Resource, Default)]
struct Outcome {
    worn: Option<HairWorn>,
    refused: Option<String>,
}

/// An app that reads glTF files of a folder, without a window.
fn app(folder: &Path) -> App {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let mut app = App::new();
    let files = AssetPlugin { file_path: folder.to_string_lossy().into_owned(), ..default() };
    app.add_plugins((MinimalPlugins, TransformPlugin, files, WorldSerializationPlugin))
        .init_asset::<Mesh>()
        .init_asset::<Image>()
        .init_asset::<SkinnedMeshInverseBindposes>()
        .init_asset::<AnimationClip>()
        .add_plugins((GltfPlugin::default(), HairPlugins::default()))
        .init_resource::<Outcome>()
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    register(&mut app);
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.add_observer(|worn: On<HairWorn>, mut outcome: ResMut<Outcome>| {
        outcome.worn = Some(worn.event().clone());
    });
    app.add_observer(|not: On<HairNotWorn>, mut outcome: ResMut<Outcome>| {
        outcome.refused = Some(not.error.to_string());
    });
    app.finish();
    app.cleanup();
    app
}

/// Hair on a character.
struct Worn {
    app: App,
    worn: HairWorn,
}

/// Loads a file and puts a preset on it.
fn wear(file: &Path, preset: HairPreset) -> Result<Worn, String> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let name = file.file_name().ok_or("no name of a file")?.to_string_lossy().into_owned();
    let mut app = app(folder.unwrap_or(Path::new(".")));
    let scene = app.world().resource::<AssetServer>();
    let scene = scene.load(GltfAssetLabel::Scene(0).from_asset(name));
    // Not at the origin: what is off by a share of the place shows.
    let at = Transform::from_xyz(2.0, 0.5, -1.0).with_rotation(Quat::from_rotation_y(0.7));
    app.world_mut().spawn((WorldAssetRoot(scene), at, WearHair::new(preset)));
    for _ in 0..PATIENCE {
        app.update();
        let outcome = app.world().resource::<Outcome>();
        if let Some(why) = &outcome.refused {
            return Err(why.clone());
        }
        if let Some(worn) = outcome.worn.clone() {
            (0..FRAMES).for_each(|_| app.update());
            return Ok(Worn { app, worn });
        }
        sleep(Duration::from_millis(2));
    }
    Err("no hair came".into())
}

impl Worn {
    fn get<T: Component>(&self, entity: Entity) -> Option<&T> {
        self.app.world().get::<T>(entity)
    }

    /// The meshes that it grows on.
    fn meshes(&self) -> Vec<Entity> {
        let roots = self.get::<RootsOnMesh>(self.worn.hair);
        let all = roots.map(|roots| {
            let others = roots.others.iter().map(|other| other.mesh);
            roots.mesh.into_iter().chain(others).collect()
        });
        all.unwrap_or_default()
    }

    /// Where roots are, in the hair's frame.
    fn roots(&self) -> Vec<Vec3> {
        let members = self.get::<Strands>(self.worn.hair);
        let strands = members.into_iter().flat_map(|members| members.iter());
        let strands = strands.filter_map(|id| self.get::<Strand>(id));
        strands.filter_map(|strand| strand.positions().first().copied()).collect()
    }

    fn place(&self, entity: Entity) -> Mat4 {
        self.get::<GlobalTransform>(entity).map_or(Mat4::IDENTITY, GlobalTransform::to_matrix)
    }

    /// A mesh as Bevy draws it, in the world.
    fn drawn(&self, entity: Entity) -> Option<Mesh> {
        let meshes = self.app.world().resource::<Assets<Mesh>>();
        let mut mesh = meshes.get(&self.get::<Mesh3d>(entity)?.0)?.clone();
        let own = self.place(entity);
        let (mut joints, mut weights) = (None, None);
        if let Some(skin) = self.get::<SkinnedMesh>(entity) {
            let poses = self.app.world().resource::<Assets<SkinnedMeshInverseBindposes>>();
            let poses = poses.get(&skin.inverse_bindposes)?;
            let each = skin.joints.iter().zip(poses.iter());
            let bones: Vec<Mat4> = each.map(|(j, pose)| self.place(*j) * *pose).collect();
            joints = mesh.remove_attribute(Mesh::ATTRIBUTE_JOINT_INDEX).zip(Some(bones));
            weights = mesh.remove_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT);
        }
        let Some(Values::Float32x3(places)) = mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION) else {
            return None;
        };
        for (v, place) in places.iter_mut().enumerate() {
            let p = Vec3::from(*place);
            *place = match (&joints, &weights) {
                (Some((Values::Uint16x4(joints), bones)), Some(Values::Float32x4(weights))) => {
                    let slots = joints[v].iter().zip(weights[v]).filter(|(_, w)| *w != 0.0);
                    let moved = slots.map(|(j, w)| {
                        let bone = bones.get(usize::from(*j)).copied().unwrap_or_default();
                        bone.transform_point3(p) * w
                    });
                    moved.sum::<Vec3>()
                }
                _ => own.transform_point3(p),
            }
            .to_array();
        }
        Some(mesh)
    }

    /// How far the farthest root is off the skin (mm).
    fn off_skin(&self) -> f32 {
        let to_world = self.place(self.worn.hair);
        let roots: Vec<Vec3> =
            self.roots().iter().map(|root| to_world.transform_point3(*root)).collect();
        let mut off = vec![f32::INFINITY; roots.len()];
        for mesh in self.meshes().into_iter().filter_map(|mesh| self.drawn(mesh)) {
            let found = RootOnMesh::nearest(&mesh, roots.iter().copied()).unwrap_or_default();
            off.iter_mut().zip(found).for_each(|(off, (_, apart))| *off = off.min(apart));
        }
        off.into_iter().fold(0.0, f32::max) * 1e3
    }

    /// The share of the scalp that has hair, by direction.
    fn covered(&self) -> f32 {
        let scalp = Scalp { front: Dir3::NEG_Z, ..default() };
        let roots: Vec<Vec3> = self.roots().iter().map(|root| root.normalize_or_zero()).collect();
        let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
        let (mut all, mut with) = (0.0, 0.0);
        for i in 0..DIRECTIONS {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / DIRECTIONS as f32;
            let (sine, cosine) = (golden * i as f32).sin_cos();
            let flat = (1.0 - y * y).sqrt();
            let way = Vec3::new(cosine * flat, y, sine * flat);
            if scalp.density(way) > 0.9 {
                all += 1.0;
                with += f32::from(u8::from(roots.iter().any(|root| root.distance(way) < NEAR)));
            }
        }
        with / all
    }

    /// The strands that are awake, and all.
    fn awake(&self) -> [usize; 2] {
        let counts = self.get::<SleepCounts>(self.worn.hair).copied().unwrap_or_default();
        [counts.awake, counts.awake + counts.asleep]
    }

    /// Puts a ball where the tip of a sleeping strand is, and tells how many strands of those that it touches still
    /// sleep two ticks later. `None` where no strand sleeps.
    fn asleep_when_touched(&mut self) -> Option<usize> {
        let members: Vec<Entity> =
            self.get::<Strands>(self.worn.hair).into_iter().flat_map(|all| all.iter()).collect();
        let to_world = self.place(self.worn.hair);
        let nodes = |app: &App, id: Entity| -> Vec<Vec3> {
            let strand = app.world().get::<Strand>(id);
            let nodes = strand.into_iter().flat_map(|strand| strand.positions());
            nodes.map(|p| to_world.transform_point3(*p)).collect()
        };
        let asleep = |app: &App, id: Entity| {
            app.world().get::<StrandSleep>(id).is_some_and(StrandSleep::is_asleep)
        };
        let sleeper = members.iter().find(|id| asleep(&self.app, **id));
        let at = nodes(&self.app, *sleeper?).last().copied()?;
        let touched: Vec<Entity> = members
            .into_iter()
            .filter(|id| nodes(&self.app, *id).iter().skip(1).any(|p| p.distance(at) < TOUCH))
            .collect();
        let ball = HairCollider::sphere(TOUCH).expect("a radius");
        let ball = self.app.world_mut().spawn((ball, Transform::from_translation(at))).id();
        (0..2).for_each(|_| self.app.update());
        let still = touched.iter().filter(|id| asleep(&self.app, **id)).count();
        self.app.world_mut().despawn(ball);
        Some(still)
    }

    /// The names of the meshes that it grows on.
    fn names(&self) -> String {
        let name = |mesh: Entity| self.get::<Name>(mesh).map_or("?".into(), Name::to_string);
        self.meshes().into_iter().map(name).collect::<Vec<_>>().join(" and ")
    }

    /// The angle from where the face was found to look to where glTF says it does (°).
    fn turned(&self) -> f32 {
        self.worn.facing.dot(Vec3::Z).clamp(-1.0, 1.0).acos().to_degrees()
    }
}

/// The rows of each file: glTF's characters look along +Z.
pub fn rows(files: &[PathBuf]) -> Vec<Row> {
    let all = |file| HairPreset::ALL.into_iter().flat_map(move |preset| of(file, preset));
    files.iter().flat_map(|file| all(file)).collect()
}

fn of(file: &Path, preset: HairPreset) -> Vec<Row> {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let head = format!("{name}, {}", preset.name());
    let mut worn = match wear(file, preset) {
        Ok(worn) => worn,
        Err(why) => return vec![Row::new(format!("{head}: {why}"), 1.0, 0.0, 0.0)],
    };
    let on = format!("{head}: hair grows on {}", worn.names());
    let looks = format!("{head}: looks along +Z by {:?} (°)", worn.worn.facing_from);
    let mut rows = vec![
        Row::new(on, 1.0, f32::from(u8::from(!worn.meshes().is_empty())), 0.0),
        Row::at_most(format!("{head}: roots off the skin (mm)"), worn.off_skin(), 0.5),
        // Where nothing tells it is assumed to be −Z, and this is outside.
        Row::at_most(looks, worn.turned(), 1.0),
    ];
    // A beard grows on the face, fur without a hairline.
    if !matches!(preset, HairPreset::Beard | HairPreset::Fur) {
        let share = format!("{head}: share of the scalp with hair");
        rows.push(Row::new(share, 1.0, worn.covered(), 0.05));
    }
    (FRAMES..REST).for_each(|_| worn.app.update());
    let [awake, all] = worn.awake();
    let name = format!("{head}: strands awake after 5 s, of {all}");
    rows.push(Row::at_most(name, awake as f32, 0.0));
    if let Some(still) = worn.asleep_when_touched() {
        let name = format!("{head}: strands asleep that a ball touches");
        rows.push(Row::at_most(name, still as f32, 0.0));
    }
    rows
}
