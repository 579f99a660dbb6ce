//! Hair grown from a groom: a few strands are simulated, the others drawn between them.

#[cfg(feature = "render")]
use super::GroomStrand;
use super::{Groom, GroomError};
use crate::{
    fault::{FaultKind, HairFault},
    setting::{Ranged, ValueRange, setting},
    strand::{Hair, Strand, StrandOf},
};
use bevy::{asset::LoadState, platform::collections::HashSet, prelude::*};

/// Hair that grows as a [`Groom`] says. Put it on the entity that is to be the [`Hair`], such as a
/// head bone; once the groom is loaded its strands appear.
///
/// The groom's origin becomes the entity's: see [`GroomSettings::origin`](super::GroomSettings::origin).
/// Changing this component, or reloading the asset, grows the hair anew; removing it shaves it off.
/// A groom that cannot be used is told as a [`HairFault`].
///
/// With the feature `render` all strands that are not guides become
/// [`FollowerRoots`](crate::render::FollowerRoots), and a hair without
/// [`HairLook`](crate::render::HairLook) takes the groom's mean colour and width, if it has them.
/// Widths and colours of single nodes stay in the asset.
///
/// ```
/// # use bevy_keratin::{prelude::*, groom::*}; use bevy::prelude::*;
/// fn head(mut commands: Commands, assets: Res<AssetServer>) {
///     commands.spawn(GroomedHair::new(assets.load("bob.hair")));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(Hair)]
pub struct GroomedHair {
    /// The groom.
    pub groom: Handle<Groom>,
    /// Which of its strands are simulated, and how finely.
    pub guides: GroomGuides,
}

impl GroomedHair {
    /// Hair of this groom, with the default number of guides.
    pub fn new(groom: Handle<Groom>) -> Self {
        Self { groom, guides: GroomGuides::default() }
    }
}

setting! {
    /// How many strands of a groom are simulated, and how finely.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct GroomGuides {
        /// How many, chosen by [`Groom::guides`].
        pub count: usize = 500, in COUNT: 1.0..=1e6, safe 1.0..=1e4, "500 suit a head";
        /// Nodes of a strand, evenly along it.
        pub nodes: usize = 16, in NODES: 2.0..=4096.0, safe 2.0..=64.0, "16 suit hair of a head";
        /// Short strands have fewer nodes, but three at least, so that their segments are no shorter
        /// than this. Strands that are shorter themselves are not simulated as long as there are
        /// others: they are stubble beside the distance that hair keeps from the head. Whatever is
        /// asked for, no segment is shorter than 1 mm.
        pub segment: f32 = 5e-3, "m" in SEGMENT: FINEST..=10.0, safe 1e-3..=0.05,
            "0.005 suits a head";
    }
}

/// The shortest segment of a guide (m): contact stretches those of a tenth of it many times over,
/// and their strands take seconds a tick.
const FINEST: f32 = 1e-3;
const LONGEST: ValueRange = ValueRange::new(
    "the longest strand's length (m)",
    FINEST..=1e6,
    "the groom's scale may be wrong: Groom::odd_size gives one that fits",
);

impl GroomGuides {
    fn nodes_of(&self, length: f32) -> usize {
        // `as` saturates.
        let nodes_at = |segment: f32| (length / segment) as usize + 1;
        nodes_at(self.segment).max(3).min(nodes_at(FINEST)).clamp(2, self.nodes)
    }
}

impl Groom {
    /// Grows this groom on `hair` at once: what [`GroomedHair`] does, for game code that makes its
    /// grooms itself. Gives the simulated strands; despawn them to take them off again.
    ///
    /// ```
    /// # use bevy_keratin::{prelude::*, groom::*}; use bevy::prelude::*;
    /// fn tuft(commands: &mut Commands) -> Result {
    ///     let roots = (0..100).map(|i| Vec3::new(i as f32 * 1e-3, 0.0, 0.0));
    ///     let groom = Groom::from_polylines(roots.map(|r| [r, r + Vec3::Y * 0.1]))?;
    ///     let hair = commands.spawn(Hair).id();
    ///     groom.spawn(commands, hair, &GroomGuides { count: 20, ..default() })?;
    ///     Ok(())
    /// }
    /// # let mut world = World::new();
    /// # tuft(&mut world.commands()).unwrap();
    /// # world.flush();
    /// # assert_eq!(world.query::<&Strand>().iter(&world).count(), 20);
    /// ```
    ///
    /// # Errors
    /// When the groom has no strand as long as 1 mm, or a number of `guides` is out of range.
    pub fn spawn(
        &self,
        commands: &mut Commands,
        hair: Entity,
        guides: &GroomGuides,
    ) -> Result<Vec<Entity>, GroomError> {
        let sown = self.sown(guides)?;
        if sown.short > 0 {
            tracing::warn!(
                "hair, entity {hair}: {} guides without length are left out",
                sown.short
            );
        }
        #[cfg(feature = "render")]
        commands.entity(hair).try_insert(sown.followers);
        Ok(sown.strands.into_iter().map(|s| commands.spawn((StrandOf(hair), s)).id()).collect())
    }

    /// What [`Groom::spawn`] spawns.
    pub(crate) fn sown(&self, guides: &GroomGuides) -> Result<Sown, GroomError> {
        guides.checked()?;
        self.check()?;
        if self.is_empty() {
            return Err(GroomError::Empty);
        }
        let lengths: Vec<f32> = self.strands().map(|s| s.length()).collect();
        LONGEST.check(lengths.iter().copied().fold(0.0, f32::max))?;
        let at_least = |least: f32| (0..self.len()).filter(|i| lengths[*i] >= least).collect();
        let mut long: Vec<usize> = at_least(guides.segment);
        if long.is_empty() {
            long = at_least(FINEST);
        }
        let chosen = self.guides_among(long, guides.count);
        let coarse = self.picked(chosen.iter().copied());
        let coarse = coarse.resampled_by(|length| guides.nodes_of(length))?;
        let strands = coarse.strands().map(|s| Strand::from_polyline(s.points));
        let strands: Vec<Strand> = strands.filter_map(Result::ok).collect();
        if strands.is_empty() {
            return Err(GroomError::Empty);
        }
        Ok(Sown {
            short: chosen.len() - strands.len(),
            strands,
            #[cfg(feature = "render")]
            followers: self.followers_of(&chosen),
        })
    }

    #[cfg(feature = "render")]
    fn followers_of(&self, guides: &[usize]) -> crate::render::FollowerRoots {
        use crate::render::{FollowerRoot, FollowerRoots};
        let mut is_guide = vec![false; self.len()];
        guides.iter().for_each(|i| is_guide[*i] = true);
        let others = self.strands().zip(&is_guide).filter(|(_, guide)| !**guide);
        let root = |strand: GroomStrand<'_>| {
            let (root, tip) = (strand.points[0], strand.points[strand.points.len() - 1]);
            FollowerRoot { place: root, length: strand.length(), reach: tip - root, ..default() }
        };
        FollowerRoots(others.map(|(strand, _)| root(strand)).collect())
    }
}

/// Hair of a groom before it is anywhere.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sown {
    /// The guides.
    pub strands: Vec<Strand>,
    /// All others.
    #[cfg(feature = "render")]
    pub followers: crate::render::FollowerRoots,
    /// How many guides have no length and are left out.
    pub short: usize,
}

/// What a hair has grown from its groom.
#[derive(Component, Debug, Default)]
pub(super) struct Grown {
    /// What it has grown from, or has failed to.
    from: Option<GroomedHair>,
    strands: Vec<Entity>,
    gave_look: bool,
}

pub(super) fn build(app: &mut App) {
    app.register_type::<GroomedHair>().register_type::<GroomGuides>();
}

/// Needs grooms to be assets.
pub(super) fn with_assets(app: &mut App) {
    app.add_systems(PreUpdate, (shave, spawn_grown).chain());
}

#[cfg(feature = "render")]
type Look = crate::render::HairLook;
#[cfg(not(feature = "render"))]
type Look = Hair;

fn spawn_grown(
    mut commands: Commands,
    mut hairs: Query<(Entity, &GroomedHair, Option<&mut Grown>, Has<Look>)>,
    mut events: MessageReader<AssetEvent<Groom>>,
    (grooms, assets): (Res<Assets<Groom>>, Res<AssetServer>),
    mut faults: MessageWriter<HairFault>,
) {
    let changed: HashSet<_> = events
        .read()
        .filter_map(|event| match event {
            AssetEvent::Modified { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (hair, wanted, grown, has_look) in &mut hairs {
        let Some(mut grown) = grown else {
            commands.entity(hair).insert(Grown::default());
            continue;
        };
        if grown.from.as_ref() == Some(wanted) && !changed.contains(&wanted.groom.id()) {
            continue;
        }
        let Some(groom) = grooms.get(&wanted.groom) else {
            if let LoadState::Failed(error) = assets.load_state(&wanted.groom) {
                // The asset server has logged the whole of it.
                let error = error.to_string();
                let error = error.lines().next().unwrap_or_default().to_owned();
                let message = format!("the hair's groom was not loaded: {error}");
                faults.write(HairFault::new(FaultKind::Groom, message).of(hair));
                grown.take_off(&mut commands, hair);
                grown.from = Some(wanted.clone());
            }
            continue;
        };
        let has_look = has_look && !grown.gave_look;
        grown.take_off(&mut commands, hair);
        grown.from = Some(wanted.clone());
        match groom.spawn(&mut commands, hair, &wanted.guides) {
            Ok(strands) => grown.strands = strands,
            Err(error) => {
                let outcome = "nothing is grown from this groom";
                faults.write(HairFault::caused(FaultKind::Groom, error, outcome).of(hair));
                continue;
            }
        }
        #[cfg(feature = "render")]
        if !has_look && let Some(look) = groom.look() {
            commands.entity(hair).insert(look);
            grown.gave_look = true;
        }
        let _ = has_look;
    }
}

impl Grown {
    /// Takes off what has grown.
    fn take_off(&mut self, commands: &mut Commands, hair: Entity) {
        // From the back: that is where a hair looks for a strand that leaves it.
        while let Some(strand) = self.strands.pop() {
            commands.entity(strand).try_despawn();
        }
        #[cfg(feature = "render")]
        {
            commands.entity(hair).try_remove::<crate::render::FollowerRoots>();
            if core::mem::take(&mut self.gave_look) {
                commands.entity(hair).try_remove::<Look>();
            }
        }
        let _ = hair;
    }
}

/// Hair that is no longer to be of a groom.
fn shave(mut commands: Commands, mut hairs: Query<(Entity, &mut Grown), Without<GroomedHair>>) {
    for (hair, mut grown) in &mut hairs {
        grown.take_off(&mut commands, hair);
        commands.entity(hair).remove::<Grown>();
    }
}
