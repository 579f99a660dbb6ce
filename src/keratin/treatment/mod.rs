//! Treatments that cut or re-form bonds, and perm rods that hair is wound on.

mod systems;
mod winding;

pub use systems::TreatmentPlugin;

use crate::{
    base::{
        setting::{InvalidValue, Ranged, ValueRange, Violations, setting},
        stretch::{Stretch, Stretched},
        tape::Tape,
    },
    hair::strand::{HeldNodes, Strand, TickPose},
    keratin::bond::{BondKind, JointBonds},
};
use bevy::prelude::*;
use core::ops::Range;

/// A request to change bond rates, for a hair (or its wearer) or one strand, all joints or some, at once or over
/// time: an event on its entity, or a message where many are sent. From the next tick on it acts through
/// equation 16, so that bonds which re-form remember the shape of that moment.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn shower(In(character): In<Entity>, mut commands: Commands) {
///     commands.trigger(HairTreatment::wet(character));
///     // dry the outer half in two seconds
///     commands.trigger(HairTreatment::dry(character).over(2.0).joints(4..8));
/// }
/// ```
#[derive(EntityEvent, Message, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairTreatment {
    /// The [`Hair`](crate::Hair) or strand to treat, or who wears it.
    #[event_target]
    pub target: Entity,
    /// The joints to treat, from the root; `None` all.
    pub joints: Option<Range<usize>>,
    /// The rate that each [`BondKind`] is to reach, `None` where it stays. Peptide bonds are never
    /// cut.
    pub rates: [Option<f32>; BondKind::COUNT],
    /// Time to reach the rates (s). Default 0: one substep. Range [`SECONDS`](Self::SECONDS).
    pub seconds: f32,
    /// Time until it begins (s). Default 0. Range [`DELAY`](Self::DELAY).
    pub delay: f32,
}

/// The share of disulfide bonds that perm lotion leaves (\[B\] §4).
pub const LOTION_DISULFIDE: f32 = 0.8;

impl HairTreatment {
    /// The range of the rates that bonds are brought to.
    pub const RATES: ValueRange = JointBonds::RATES.named("HairTreatment::rates");
    /// The range of [`seconds`](Self::seconds).
    pub const SECONDS: ValueRange =
        ValueRange::new("HairTreatment::seconds (s)", 0.0..=1e6, "0 acts at once")
            .with_safe(0.0..=60.0);

    /// The range of [`delay`](Self::delay).
    pub const DELAY: ValueRange =
        ValueRange::new("HairTreatment::delay (s)", 0.0..=1e6, "0 begins at once")
            .with_safe(0.0..=600.0);

    fn rates(target: Entity, rates: [Option<f32>; BondKind::COUNT]) -> Self {
        Self { target, joints: None, rates, seconds: 0.0, delay: 0.0 }
    }

    /// A whole perm on hair that is wound or held in the desired shape: lotion, neutraliser and drying,
    /// each taking `seconds`, which [`HairProcessTime`](crate::HairProcessTime) shortens. Release the hair after
    /// three times that.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// fn perm(In(character): In<Entity>, mut treat: MessageWriter<HairTreatment>) {
    ///     treat.write_batch(HairTreatment::perm_set(character, 5.0));
    /// }
    /// ```
    pub fn perm_set(target: Entity, seconds: f32) -> [Self; 3] {
        let steps = [Self::lotion(target), Self::neutraliser(target), Self::dry(target)];
        let mut delay = -seconds;
        steps.map(|step| {
            delay += seconds;
            step.over(seconds).after(delay)
        })
    }

    /// Soaks: cuts the hydrogen bonds.
    pub fn wet(target: Entity) -> Self {
        Self::rates(target, [Some(0.0), None, None, None])
    }

    /// Dries: the hydrogen bonds re-form around the present shape.
    pub fn dry(target: Entity) -> Self {
        Self::rates(target, [Some(1.0), None, None, None])
    }

    /// Perm lotion: cuts hydrogen and ionic bonds, and a fifth of the disulfide bonds.
    pub fn lotion(target: Entity) -> Self {
        Self::rates(target, [Some(0.0), Some(0.0), Some(LOTION_DISULFIDE), None])
    }

    /// Neutraliser and rinse: ionic and disulfide bonds re-form. Hydrogen bonds wait for drying.
    pub fn neutraliser(target: Entity) -> Self {
        Self::rates(target, [None, Some(1.0), Some(1.0), None])
    }

    /// Shampoo: cuts hydrogen and ionic bonds.
    pub fn shampoo(target: Entity) -> Self {
        Self::rates(target, [Some(0.0), Some(0.0), None, None])
    }

    /// All bonds re-form around the present shape, which becomes the hair's natural shape.
    pub fn set_everything(target: Entity) -> Self {
        Self::rates(target, [Some(1.0); BondKind::COUNT])
    }

    /// Brings one kind to a rate.
    ///
    /// # Errors
    /// When the rate is outside [`RATES`](Self::RATES).
    pub fn set(target: Entity, kind: BondKind, rate: f32) -> Result<Self, InvalidValue> {
        let mut rates = [None; BondKind::COUNT];
        rates[kind as usize] = Some(Self::RATES.check(rate)?);
        Ok(Self::rates(target, rates))
    }

    /// The same treatment of these joints only, counted from the root.
    pub fn joints(mut self, joints: Range<usize>) -> Self {
        self.joints = Some(joints);
        self
    }

    /// The same treatment, beginning after `seconds` ([`DELAY`](Self::DELAY)), which
    /// [`HairProcessTime`](crate::HairProcessTime) shortens. A value out of range is clamped and reported when
    /// the treatment begins.
    pub fn after(mut self, seconds: f32) -> Self {
        self.delay = seconds;
        self
    }

    /// The same treatment, taking `seconds` ([`SECONDS`](Self::SECONDS)), which
    /// [`HairProcessTime`](crate::HairProcessTime) shortens. A value out of range is clamped and reported when
    /// the treatment begins.
    pub fn over(mut self, seconds: f32) -> Self {
        self.seconds = seconds;
        self
    }
}

impl Ranged for HairTreatment {
    fn clamp_values(&mut self, violations: &mut Violations) {
        Self::SECONDS.clamp(&mut self.seconds, || 0.0, violations);
        Self::DELAY.clamp(&mut self.delay, || 0.0, violations);
        for rate in self.rates.iter_mut().flatten() {
            Self::RATES.clamp(rate, || 1.0, violations);
        }
    }
}

/// The treatments that are acting on a strand. Kept by the tick.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone)]
pub struct Treatments {
    acting: Vec<HairTreatment>,
}

impl Treatments {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let count = tape.count(self.acting.len(), size_of::<Entity>());
        self.acting.resize_with(count, || HairTreatment::wet(Entity::PLACEHOLDER));
        for HairTreatment { target, joints, rates, seconds, delay } in &mut self.acting {
            tape.entity(target);
            tape.option(joints, |tape, Range { start, end }| {
                for at in [start, end] {
                    let mut joint = *at as u64;
                    tape.value(&mut joint);
                    *at = joint as usize;
                }
            });
            rates.iter_mut().for_each(|rate| tape.option(rate, Tape::value));
            tape.values([seconds, delay]);
        }
    }

    /// The treatments, oldest first, with the remaining delay and duration.
    pub fn acting(&self) -> &[HairTreatment] {
        &self.acting
    }

    /// The treatments, for those that hand hair over.
    #[cfg(feature = "gpu")]
    pub(crate) fn acting_mut(&mut self) -> &mut Vec<HairTreatment> {
        &mut self.acting
    }
}

setting! {
    /// A cylinder along Y that strands are wound on: see [`PermWinding`]. Despawn it to release
    /// them. It stays round: an uneven scale of its transform counts by its mean, which is
    /// reported.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose, Stretch<Self>)]
    pub struct PermRod {
        /// Radius. A joint bends by 2 asin(l/2R): keep segments below 1.7 times the radius.
        pub radius: f32 = 0.03, "m" in RADIUS: 1e-3..=10.0, safe 0.003..=0.1,
            "3 cm is the paper's size";
        /// Length.
        pub length: f32 = 0.2, "m" in LENGTH: 1e-3..=100.0, safe 0.01..=1.0,
            "0.2 takes a row of hair";
    }
}

impl PermRod {
    /// A rod of `radius` and `length` (m).
    ///
    /// # Errors
    /// When one is outside [`RADIUS`](Self::RADIUS) or [`LENGTH`](Self::LENGTH).
    pub fn new(radius: f32, length: f32) -> Result<Self, InvalidValue> {
        Self { radius, length }.checked()
    }
}

impl Stretched for PermRod {
    fn suitable(&self, _: Vec3) -> Vec3 {
        Vec3::ONE
    }

    fn stretched(self, _: Vec3) -> Self {
        self
    }
}

/// The rod that a strand is wound on. Removing it, despawning the rod or removing its [`PermRod`] releases the strand.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Component, Clone, PartialEq)]
#[relationship(relationship_target = WoundStrands)]
#[require(PermWinding, WindingProgress, HeldNodes)]
pub struct WoundOn(pub Entity);

/// The strands on a [`PermRod`]. Kept by Bevy.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone)]
#[relationship_target(relationship = WoundOn)]
pub struct WoundStrands(Vec<Entity>);

setting! {
    /// How a strand is wound on its rod.
    ///
    /// The nodes are held and guided from the strand's pose when winding begins, through helices
    /// whose radius shrinks to the rod's, each of the strand's own length, so that no edge is
    /// stretched. Bonds may then set in that shape.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct PermWinding {
        /// Index of the first node on the rod; the root, 0, stays on the scalp.
        pub from_node: usize = 2, in FROM_NODE: 1.0..=1e6, safe 1.0..=64.0, "2 keeps off the scalp";
        /// Advance along the rod's axis per turn. At 4 mm turns lie side by side.
        pub pitch: f32 = 0.004, "m" in PITCH: -10.0..=10.0, safe 0.0..=0.1,
            "0.004 lays turns side by side";
        /// Time that winding takes; 0 winds at once.
        pub seconds: f32 = 2.0, "s" in SECONDS: 0.0..=1e6, safe 0.0..=60.0, "2 is quick";
    }
}

/// Progress of winding. Kept by the tick.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone)]
pub struct WindingProgress {
    progress: f32,
    /// Where the strand was when winding began, in the hair's frame.
    #[reflect(ignore)]
    start: Vec<Vec3>,
    /// Positions of its nodes once they are wound, in the rod's frame.
    #[reflect(ignore)]
    on_rod: Vec<Vec3>,
}

impl WindingProgress {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.value(&mut self.progress);
        tape.list(&mut self.start);
        tape.list(&mut self.on_rod);
    }

    /// Whether winding of the strand on its rod has not begun.
    pub(crate) fn waits(&self, strand: &Strand, settings: &PermWinding) -> bool {
        settings.clamped().from_node < strand.edges() && self.start.len() != strand.nodes()
    }

    /// Begins winding from where the strand is.
    pub(crate) fn begin(&mut self, strand: &Strand) {
        *self = Self { start: strand.positions().to_vec(), ..default() };
    }

    /// 0 has just begun, 1 is wound.
    pub fn progress(&self) -> f32 {
        self.progress
    }
}
