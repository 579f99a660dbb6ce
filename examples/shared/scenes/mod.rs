//! The three scenes of the bond paper with table 1's values, the wet-hair paper's experiment, and a
//! shower that closes the loop, as a library for both examples.
//!
//! A customer lies back in the salon: the hair hangs from the head. `bedhead` and `blow-dry` press it
//! on the floor, `perm` winds it on a rod. Each has controls that leave something out. The scenes run
//! on a clock of paper frames, 1/60 s each: whether a frame of the paper is a step or a rendered
//! frame cannot be decided from it, and with one step a frame the hair is still swinging at its end.
//!
//! `wet` strews droplets over a head of ten thousand strands, which gather in locks. `shower` wets
//! straight hair, presses it on the floor, lets a night dry it, lifts it, and showers it again; no code
//! sets a bond's rate there. Its variant `two-hairs` has a second hair beside the first, under the same
//! drops.
//!
//! Winding is done by the simulation's own [`PermWinding`]: nodes are guided through ever tighter
//! helices onto the rod.

#![allow(dead_code, reason = "each example uses its own part")]

pub mod locks;
pub mod measure;
mod script;
mod strands;

use bevy::{ecs::system::SystemParam, prelude::*};
use bevy_keratin::{DropletRules, prelude::*};
use core::{fmt, str::FromStr};

#[allow(unused_imports, reason = "each example uses its own part")]
pub use script::{BUST_HIGH, Director, Moment};

/// Which story is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    Bedhead,
    BlowDry,
    Perm,
    Wet,
    Shower,
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
    pub const ALL: [Self; 5] = [Self::Bedhead, Self::BlowDry, Self::Perm, Self::Wet, Self::Shower];

    pub fn name(self) -> &'static str {
        match self {
            Self::Bedhead => "bedhead",
            Self::BlowDry => "blow-dry",
            Self::Perm => "perm",
            Self::Wet => "wet",
            Self::Shower => "shower",
        }
    }

    /// The variants, the full treatment first, then its controls.
    pub fn variants(self) -> &'static [&'static str] {
        match self {
            Self::Bedhead => &["treated", "never-wet", "never-dried"],
            Self::BlowDry => &["treated", "no-drying", "uniform"],
            Self::Perm => &["treated", "water-set", "cut-only", "untreated"],
            Self::Wet => &["rods", "springs"],
            Self::Shower => &["treated", "never-wet", "dried-free", TWO_HAIRS],
        }
    }

    /// How many frames the story has; where the paper shows it, the paper's.
    pub fn frames(self) -> u32 {
        match self {
            Self::Bedhead | Self::BlowDry => 1170,
            Self::Perm => 900,
            Self::Wet => 720,
            Self::Shower => 2400,
        }
    }

    /// The frames that tell the story; where the paper prints some, those.
    pub fn shown(self) -> [u32; 4] {
        match self {
            Self::Bedhead | Self::BlowDry => [0, 390, 780, 1170],
            Self::Perm => [0, 450, 630, 900],
            Self::Wet => [0, 300, 420, 720],
            Self::Shower => [30, 360, 900, 1440],
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

/// The hair that a scene is about; others are there to be seen only.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct Treated;

/// What a thing is, for whoever draws it.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// A head whose scalp plane, seen from its centre, is at −Y (radius in m).
    Head(f32),
    /// A perm rod along Y (radius, length in m).
    Rod(f32, f32),
    /// A blower that points along −Z.
    Blower,
    /// A shower head that points along −Z.
    Shower,
    /// An upright head around its origin (radius in m).
    Bust(f32),
}

/// The droplets that the scene `wet` strews.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct Strewn {
    pub count: usize,
    /// Their radius, and r_min; r_max is five times as much (m).
    pub radius: f32,
}

impl Default for Strewn {
    fn default() -> Self {
        Self { count: 1000, radius: 0.003 }
    }
}

/// The variant with a second hair beside the first.
const TWO_HAIRS: &str = "two-hairs";

/// How far the hair's roots are below the centre of the head that is drawn (m).
pub const HEAD_RADIUS: f32 = 0.1;

/// Runs a scene in the app: spawns it at startup and directs it every fixed tick.
pub struct ScenePlugin(pub Scene);

impl Plugin for ScenePlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.0)
            .insert_resource(Time::<Fixed>::from_hz(60.0))
            .init_resource::<Director>()
            .init_resource::<Strewn>()
            .init_resource::<measure::StrainPeak>()
            .init_resource::<measure::Lift>()
            .add_systems(Startup, spawn_scene)
            .add_systems(FixedUpdate, script::direct)
            .add_systems(
                HairTick,
                (
                    measure::watch_strain.run_if(resource_exists::<measure::StrainPeak>),
                    measure::watch_lift,
                )
                    .in_set(HairSystems::Last),
            );
    }
}

/// What a scene sets of the world around the hair; the rest are defaults.
#[derive(SystemParam)]
pub struct Surroundings<'w> {
    gravity: ResMut<'w, HairGravity>,
    drag: ResMut<'w, HairDefault<AirDrag>>,
    wetting: ResMut<'w, HairDefault<HairWetting>>,
    contact: ResMut<'w, HairDefault<StrandContact>>,
    substeps: ResMut<'w, HairSubsteps>,
    solver: ResMut<'w, HairDefault<HairSolver>>,
    stiffness: ResMut<'w, HairDefault<HairStiffness>>,
    climate: ResMut<'w, HairClimate>,
    process: ResMut<'w, HairProcessTime>,
    rules: ResMut<'w, DropletRules>,
}

impl Surroundings<'_> {
    fn set(&mut self, kind: SceneKind) {
        *self.gravity = default();
        **self.drag = default();
        **self.wetting = default();
        **self.contact = default();
        *self.substeps = default();
        // The papers' scenes are computed at the papers' step.
        self.solver.substep = 1.0 / 360.0;
        // Hair of the papers resists twist as much as bending.
        self.stiffness.torsion = 1.0;
        *self.climate = default();
        *self.process = default();
        *self.rules = default();
        match kind {
            SceneKind::Wet => {
                // [W]: four updates a frame, no contact between strands, droplets that stay whole and
                // where they land.
                *self.substeps = HairSubsteps::Fixed(4);
                self.drag.rate = 3.0;
                self.contact.strength = 0.0;
                self.wetting.fibres = 10.0;
                self.wetting.sliding = 0.0;
                self.rules.merging = false;
            }
            // Minutes in seconds.
            SceneKind::Shower => self.process.0 = 60.0,
            _ => {}
        }
    }
}

/// Clears what is there.
pub fn clear(
    mut commands: Commands,
    mut director: ResMut<Director>,
    mut peak: ResMut<measure::StrainPeak>,
    props: Query<Entity, Or<(With<Prop>, With<Droplet>)>>,
) {
    for prop in &props {
        commands.entity(prop).despawn();
    }
    // After them: what they held is booked when they go.
    commands.insert_resource(WaterLedger::default());
    *director = Director::default();
    *peak = default();
    commands.insert_resource(measure::Lift::default());
}

/// Sets the stage, which is clear, for the scene in the resource.
pub fn spawn_scene(mut commands: Commands, scene: Res<Scene>, mut surroundings: Surroundings) {
    surroundings.set(scene.kind);
    // The paper's floor.
    commands.spawn((Prop, HairCollider::plane(Dir3::Y)));
    let hair = commands
        .spawn((
            Prop,
            Treated,
            Hair,
            Transform::from_translation(script::root_path(scene.kind, 0.0)),
        ))
        .id();
    match scene.kind {
        SceneKind::Wet => {
            let model = match scene.variant {
                "springs" => StrandModel::MassSpring,
                _ => StrandModel::Rod,
            };
            // Soft hair, that hangs.
            let stiffness = HairStiffness { bending_length: 0.06, torsion: 1.0, ..default() };
            commands.entity(hair).insert((model, stiffness));
            commands.spawn((
                Prop,
                Model::Bust(strands::BUST),
                ChildOf(hair),
                HairCollider::sphere(strands::BUST).expect("a head has a radius"),
                Transform::default(),
            ));
        }
        _ => {
            commands.spawn((
                Prop,
                Model::Head(HEAD_RADIUS),
                ChildOf(hair),
                Transform::from_xyz(0.0, HEAD_RADIUS, 0.0),
            ));
        }
    }
    strands::spawn(&mut commands, scene.kind, hair);
    if scene.variant == TWO_HAIRS {
        // Where the drops go that pass the first; it moves along with it.
        let beside = Transform::from_xyz(0.055, 0.0, 0.0);
        let second = commands.spawn((Prop, Hair, ChildOf(hair), beside)).id();
        strands::spawn(&mut commands, scene.kind, second);
    }
}
