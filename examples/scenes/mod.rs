//! The three scenes of the paper, with table 1's values, as a library for both examples.
//!
//! A customer lies back in the salon: the hair hangs from the head. `bedhead` and `blow-dry` press it
//! on the floor, `perm` winds it on a rod. Each has controls that leave something out. The scenes run
//! on a clock of paper frames, 1/60 s each: whether a frame of the paper is a step or a rendered
//! frame cannot be decided from it, and with one step a frame the hair is still swinging at its end.
//!
//! Winding is done by the simulation's own [`Winding`]: nodes are guided through ever tighter
//! helices onto the rod.

#![allow(dead_code, reason = "each example uses its own part")]

pub mod measure;
mod script;

use bevy::prelude::*;
use bevy_keratin::{WindReceived, prelude::*};
use core::{fmt, str::FromStr};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

#[allow(unused_imports, reason = "each example uses its own part")]
pub use script::{Director, Moment};

/// Which story is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    Bedhead,
    BlowDry,
    Perm,
}

/// A story and which control of it.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scene {
    pub kind: SceneKind,
    pub variant: &'static str,
}

/// A name that is none of the valid ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownName {
    what: &'static str,
    found: String,
    valid: Vec<&'static str>,
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "there is no {} `{}`; valid: {}", self.what, self.found, self.valid.join(", "))
    }
}

impl std::error::Error for UnknownName {}

impl SceneKind {
    pub const ALL: [Self; 3] = [Self::Bedhead, Self::BlowDry, Self::Perm];

    pub fn name(self) -> &'static str {
        match self {
            Self::Bedhead => "bedhead",
            Self::BlowDry => "blow-dry",
            Self::Perm => "perm",
        }
    }

    /// The variants, the full treatment first, then its controls.
    pub fn variants(self) -> &'static [&'static str] {
        match self {
            Self::Bedhead => &["treated", "never-wet", "never-dried"],
            Self::BlowDry => &["treated", "no-drying", "uniform"],
            Self::Perm => &["treated", "water-set", "cut-only", "untreated"],
        }
    }

    /// How many frames the paper shows.
    pub fn frames(self) -> u32 {
        match self {
            Self::Bedhead | Self::BlowDry => 1170,
            Self::Perm => 900,
        }
    }

    /// The frames that the paper prints.
    pub fn shown(self) -> [u32; 4] {
        match self {
            Self::Bedhead | Self::BlowDry => [0, 390, 780, 1170],
            Self::Perm => [0, 450, 630, 900],
        }
    }
}

impl FromStr for SceneKind {
    type Err = UnknownName;
    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| UnknownName {
            what: "scene",
            found: name.into(),
            valid: Self::ALL.map(Self::name).to_vec(),
        })
    }
}

impl Scene {
    /// A scene with one of its variants; the full treatment when `None`.
    pub fn new(kind: SceneKind, variant: Option<&str>) -> Result<Self, UnknownName> {
        let variants = kind.variants();
        let name = variant.unwrap_or(variants[0]);
        let variant = variants.iter().find(|v| **v == name).ok_or_else(|| UnknownName {
            what: "variant",
            found: name.into(),
            valid: variants.to_vec(),
        })?;
        Ok(Self { kind, variant })
    }
}

/// Everything a scene spawns carries this, so that it can be cleared away.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct Prop;

/// What a thing is, for whoever draws it.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// A head whose scalp plane, seen from its centre, is at −Y (radius in m).
    Head(f32),
    /// A perm rod along Y (radius, length in m).
    Rod(f32, f32),
    /// A blower that points along −Z.
    Blower,
}

/// How far the hair's roots are below the centre of the head that is drawn (m).
pub const HEAD_RADIUS: f32 = 0.1;

/// The scenes' spacing of strands (m): rows touch at lock radius 1 mm in the perm.
const PATCH_SPACING: f32 = 0.005;
const ROD_SPACING: f32 = 0.002;

/// How far roots are off their grid, as a share of its spacing.
const JITTER: f32 = 0.2;

/// Length between nodes (m): table 1's 0.33 nodes per cm.
const SEGMENT: f32 = 0.03;

/// Runs a scene in the app: spawns it at startup and directs it every fixed tick.
pub struct ScenePlugin(pub Scene);

impl Plugin for ScenePlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.0)
            .insert_resource(Time::<Fixed>::from_hz(60.0))
            .init_resource::<Director>()
            .init_resource::<measure::StrainPeak>()
            .add_systems(Startup, spawn_scene)
            .add_systems(FixedUpdate, script::direct)
            .add_systems(HairTick, measure::watch_strain.in_set(HairSystems::Last));
    }
}

/// Clears what is there and sets the stage for the scene in the resource.
pub fn spawn_scene(
    mut commands: Commands,
    scene: Res<Scene>,
    mut director: ResMut<Director>,
    mut peak: ResMut<measure::StrainPeak>,
    mut gravity: ResMut<HairGravity>,
    mut drag: ResMut<HairDefault<AirDrag>>,
    props: Query<Entity, With<Prop>>,
) {
    for prop in &props {
        commands.entity(prop).despawn();
    }
    *director = Director::default();
    *peak = default();
    *gravity = default();
    **drag = default();
    // The paper's floor.
    commands.spawn((Prop, HairCollider::plane(Dir3::Y)));
    let hair = commands
        .spawn((Prop, Hair, Transform::from_translation(script::root_path(scene.kind, 0.0))))
        .id();
    commands.spawn((
        Prop,
        Model::Head(HEAD_RADIUS),
        ChildOf(hair),
        Transform::from_xyz(0.0, HEAD_RADIUS, 0.0),
    ));
    let (rows, columns, spacing, segments) = match scene.kind {
        SceneKind::Bedhead | SceneKind::BlowDry => (10, 20, PATCH_SPACING, 8),
        SceneKind::Perm => (1, 100, ROD_SPACING, 16),
    };
    // Combed a little to one side, so that it folds that way on the floor.
    let lean = if scene.kind == SceneKind::Perm { 0.0 } else { 7.0_f32.to_radians() };
    let direction = Quat::from_rotation_z(lean) * Vec3::NEG_Y;
    // No scalp is a grid: roots are a little off theirs, the same way every time.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut jitter = || spacing * random.random_range(-JITTER..JITTER);
    for row in 0..rows {
        for column in 0..columns {
            let place = |i: usize, n: usize| (i as f32 - 0.5 * (n - 1) as f32) * spacing;
            let grid = Vec3::new(place(row, rows), 0.0, place(column, columns));
            // A row on a rod lies straight along it.
            let across = if rows > 1 { jitter() } else { 0.0 };
            let root = grid + Vec3::new(across, 0.0, jitter());
            let points: Vec<Vec3> =
                (0..=segments).map(|i| root + direction * (SEGMENT * i as f32)).collect();
            let strand = Strand::from_polyline(&points).expect("points are apart");
            commands.spawn((StrandOf(hair), strand, WindReceived::default()));
        }
    }
}
