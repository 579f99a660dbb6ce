//! Hair grown from a groom: a few strands are simulated, the others drawn between them.

#[cfg(feature = "render")]
use super::GroomStrand;
use super::{Groom, GroomError, RootBones};
#[cfg(feature = "save")]
use crate::hairdo::save::Regrowth;
use crate::{
    authoring::attach::RootsOnBones,
    base::{
        fault::{FaultKind, HairFault},
        schedule::HairFrame,
        setting::{Ranged, ValueRange, setting},
    },
    hair::strand::{Hair, Strand, StrandOf, Strands},
    solver::rod::StrandMaterial,
};
use bevy::{asset::LoadState, platform::collections::HashSet, prelude::*};

/// Hair made from a [`Groom`] asset. Put it on the entity that becomes the [`Hair`], such as a head bone;
/// its strands are spawned once the groom is loaded.
///
/// The groom's origin becomes the entity's: see [`GroomSettings::origin`](super::GroomSettings::origin).
/// Roots of a groom with [bones](Groom::bones) follow these: see [`RootsOnBones`].
/// Changing this component, or reloading the asset, makes the hair again; removing it despawns it. Where the groom is the
/// same asset, what has been done to the hair stays (feature `save`): each strand takes it over from the one of its
/// number, or where there are more or fewer from the nearest one. It is what differs from how the strand grew: the bonds'
/// memory and rates, pose, water, ties, the share of its [`HairStyle`](crate::HairStyle) that is left. Hair that was cut has
/// the lengths of the groom again.
/// A groom that cannot be used is reported as a [`HairFault`].
///
/// With the feature `render` all strands that are not guides become
/// [`FollowerRoots`](crate::render::FollowerRoots), and a hair without
/// [`HairLook`](crate::render::HairLook) takes the groom's mean colour and width, if it has them.
/// A strand that is drawn between guides is as wide beside the others as its mean width is; widths and colours of single
/// nodes stay in the asset. Guides of a groom with [stiffness](Groom::with_stiffness)
/// or [damping](Groom::with_damping) have theirs.
///
/// ```
/// # use bevy_keratin::{prelude::*, authoring::groom::*}; use bevy::prelude::*;
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
        /// How many, chosen by [`Groom::guides`]: of those that the file marks as guides, if it does.
        pub count: usize = 500, in COUNT: 1.0..=1e6, safe 1.0..=1e4, "500 suit a head";
        /// Nodes of a strand, evenly along it.
        pub nodes: usize = 16, in NODES: 2.0..=4096.0, safe 2.0..=64.0, "16 suit hair of a head";
        /// Short strands have fewer nodes, but at least three, so that their segments are no shorter
        /// than this. Strands shorter than one segment are simulated only if there are no others,
        /// because they are shorter than the distance that hair keeps from the head. No segment is
        /// shorter than 1 mm in any case.
        pub segment: f32 = 5e-3, "m" in SEGMENT: FINEST..=10.0, safe 1e-3..=0.05,
            "0.005 suits a head";
    }
}

/// The shortest segment of a guide (m): with a tenth of it contact overstretches strands, and a tick
/// takes seconds.
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
    /// Spawns this groom on `hair` at once, as [`GroomedHair`] does, for game code that makes its grooms
    /// itself. Returns the simulated strands; despawn them to remove the hair.
    ///
    /// ```
    /// # use bevy_keratin::{prelude::*, authoring::groom::*}; use bevy::prelude::*;
    /// fn spawn_lock(commands: &mut Commands) -> Result {
    ///     let roots = (0..100).map(|i| Vec3::new(i as f32 * 1e-3, 0.0, 0.0));
    ///     let groom = Groom::from_polylines(roots.map(|r| [r, r + Vec3::Y * 0.1]))?;
    ///     let hair = commands.spawn(Hair).id();
    ///     groom.spawn(commands, hair, &GroomGuides { count: 20, ..default() })?;
    ///     Ok(())
    /// }
    /// # let mut world = World::new();
    /// # spawn_lock(&mut world.commands()).unwrap();
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
        let grown_strands = self.grown_strands(guides)?;
        if grown_strands.short > 0 {
            tracing::warn!(
                "hair, entity {hair}: {} guides without length are left out",
                grown_strands.short
            );
        }
        if let Some(bones) = grown_strands.bones {
            commands.entity(hair).queue_silenced(move |mut hair: EntityWorldMut| {
                let bones = bones.at_rest_as(hair.get());
                hair.insert(bones);
            });
        }
        #[cfg(feature = "render")]
        commands.entity(hair).try_insert(grown_strands.followers);
        let strands = grown_strands.strands.into_iter();
        let strands: Vec<Entity> =
            strands.map(|strand| commands.spawn((StrandOf(hair), strand)).id()).collect();
        let own = grown_strands.materials;
        commands.insert_batch(strands.iter().copied().zip(own).collect::<Vec<_>>());
        Ok(strands)
    }

    /// The strands and followers that [`Groom::spawn`] spawns.
    pub(crate) fn grown_strands(&self, guides: &GroomGuides) -> Result<GrownStrands, GroomError> {
        guides.checked()?;
        if self.is_empty() {
            return Err(GroomError::Empty);
        }
        let lengths: Vec<f32> = self.strands().map(|s| s.length()).collect();
        LONGEST.check(lengths.iter().copied().fold(0.0, f32::max))?;
        let no_shorter = |least: f32| (0..self.len()).filter(|i| lengths[*i] >= least).collect();
        let mut long: Vec<usize> = no_shorter(guides.segment);
        if long.is_empty() {
            long = no_shorter(FINEST);
        }
        let chosen = self.guides_among(long, guides.count);
        let coarse = self.picked(chosen.iter().copied());
        let coarse = coarse.resampled_by(|length| guides.nodes_of(length))?;
        let mut bones = RootBones { names: coarse.bones.names.clone(), ..default() };
        let (mut strands, mut materials) = (Vec::with_capacity(coarse.len()), Vec::new());
        for (i, line) in coarse.strands().enumerate() {
            if let Ok(strand) = Strand::from_polyline(line.points) {
                strands.push(strand);
                bones.strands.extend(coarse.bones.strands.get(i));
                materials.extend(line.material());
            }
        }
        if strands.is_empty() {
            return Err(GroomError::Empty);
        }
        let roots = || strands.iter().map(|strand| strand.positions()[0]).collect();
        let is_bound = !bones.strands.is_empty();
        Ok(GrownStrands {
            bones: is_bound.then(|| RootsOnBones { roots: roots(), bones, ..default() }),
            short: chosen.len() - strands.len(),
            strands,
            materials,
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
        let mean = self.mean_width().filter(|mean| *mean > 0.0);
        let root = |strand: GroomStrand<'_>| {
            let (root, tip) = (strand.points[0], strand.points[strand.points.len() - 1]);
            let widths = strand.widths.unwrap_or_default();
            let own = widths.iter().sum::<f32>() / widths.len().max(1) as f32;
            let width = mean.filter(|_| !widths.is_empty()).map_or(1.0, |mean| own / mean);
            FollowerRoot { place: root, length: strand.length(), reach: tip - root, width }
        };
        FollowerRoots(others.map(|(strand, _)| root(strand)).collect())
    }
}

/// Strands and followers of a groom before they are spawned.
#[derive(Clone, Debug, Default)]
pub(crate) struct GrownStrands {
    /// The guides.
    pub strands: Vec<Strand>,
    /// What each is beside the others; empty where all are alike.
    pub materials: Vec<StrandMaterial>,
    /// What their roots follow, if the groom says so.
    pub bones: Option<RootsOnBones>,
    /// All other strands.
    #[cfg(feature = "render")]
    pub followers: crate::render::FollowerRoots,
    /// How many guides have no length and are left out.
    pub short: usize,
}

/// What a hair has from its groom, beside its strands.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub(super) struct Grown {
    /// The groom that was used, or failed.
    from: Option<GroomedHair>,
    gave_look: bool,
    gave_bones: bool,
}

/// Marks a strand that its hair has from its groom.
#[derive(Component, Reflect, Clone, Copy, Debug, Default)]
#[component(storage = "SparseSet")]
#[reflect(Component, Default, Clone)]
pub(super) struct GrownStrand;

pub(super) fn build(app: &mut App) {
    app.register_type::<GroomedHair>()
        .register_type::<GroomGuides>()
        .register_type::<Grown>()
        .register_type::<GrownStrand>();
}

/// Needs grooms to be assets.
pub(super) fn with_assets(app: &mut App) {
    app.add_systems(HairFrame, (remove_groomed, spawn_grown).chain());
}

#[cfg(feature = "render")]
type Look = crate::render::HairLook;
#[cfg(not(feature = "render"))]
type Look = Hair;

fn spawn_grown(
    mut commands: Commands,
    mut hairs: Query<(Entity, &GroomedHair, Option<&mut Grown>, Option<&Strands>, Has<Look>)>,
    own: Query<Entity, With<GrownStrand>>,
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
    for (hair, wanted, grown, members, has_look) in &mut hairs {
        let Some(mut grown) = grown else {
            commands.entity(hair).insert(Grown::default());
            continue;
        };
        // Hair may be copied without its strands.
        let is_bald = grown.is_added() && members.is_none();
        let is_same = grown.from.as_ref() == Some(wanted) && !is_bald;
        if is_same && !changed.contains(&wanted.groom.id()) {
            continue;
        }
        let Some(groom) = grooms.get(&wanted.groom) else {
            if let LoadState::Failed(error) = assets.load_state(&wanted.groom) {
                // The asset server has logged the full error.
                let error = error.to_string();
                let error = error.lines().next().unwrap_or_default().to_owned();
                let message = format!("the hair's groom was not loaded: {error}");
                faults.write(HairFault::new(FaultKind::Groom, message).of(hair));
                grown.take_off(&mut commands, hair, members, &own);
                grown.from = Some(wanted.clone());
            }
            continue;
        };
        // The same groom, changed: what has been done to the hair stays.
        #[cfg(feature = "save")]
        let regrowth = (grown.from.as_ref())
            .filter(|before| before.groom == wanted.groom && members.is_some())
            .map(|_| {
                Regrowth::take(&mut commands, hair, |strand| strand.contains::<GrownStrand>())
            });
        let has_look = has_look && !grown.gave_look;
        grown.take_off(&mut commands, hair, members, &own);
        grown.from = Some(wanted.clone());
        let gives_bones = groom.bones().is_some();
        if core::mem::replace(&mut grown.gave_bones, gives_bones) && !gives_bones {
            commands.entity(hair).try_remove::<RootsOnBones>();
        }
        match groom.spawn(&mut commands, hair, &wanted.guides) {
            Ok(strands) => {
                let marked = strands.into_iter().map(|strand| (strand, GrownStrand));
                commands.insert_batch(marked.collect::<Vec<_>>());
                #[cfg(feature = "save")]
                if let Some(regrowth) = regrowth {
                    regrowth.put_on(&mut commands, hair, |of| of.contains::<GrownStrand>());
                }
            }
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
    /// Despawns the strands.
    fn take_off(
        &mut self,
        commands: &mut Commands,
        hair: Entity,
        members: Option<&Strands>,
        own: &Query<Entity, With<GrownStrand>>,
    ) {
        // From the back, where `Strands` searches for a removed strand first.
        let members = members.map_or(&[][..], |members| members.collection());
        for strand in own.iter_many(members.iter().rev()) {
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

/// Removes the strands of hair whose [`GroomedHair`] was removed.
fn remove_groomed(
    mut commands: Commands,
    mut hairs: Query<(Entity, &mut Grown, Option<&Strands>), Without<GroomedHair>>,
    own: Query<Entity, With<GrownStrand>>,
) {
    for (hair, mut grown, members) in &mut hairs {
        grown.take_off(&mut commands, hair, members, &own);
        if grown.gave_bones {
            commands.entity(hair).remove::<RootsOnBones>();
        }
        commands.entity(hair).remove::<Grown>();
    }
}
