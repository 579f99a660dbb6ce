//! Taking a hairdo from a hair in the world, and putting it on.

use super::{Hairdo, HairdoError, StyledStrand, holds::holds_of};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        setting::{HairDefault, HairSetting, Ranged},
    },
    forces::environment::HairGravity,
    hair::{
        look::{HairDye, HairLook, WornPreset},
        strand::{
            AddedMass, CutStrand, FollowerCuts, HeldNodes, Strand, StrandHistory, Strands,
            is_on_gpu, return_to_cpu,
        },
        worn::hairs_of,
    },
    keratin::{
        bond::{BondChanges, Bonds, Cuticle, RestShape},
        treatment::{Treatments, WindingProgress, WoundOn},
    },
    water::{HairWetting, Moisture, WaterLedger},
};
use bevy::{ecs::system::EntityCommand, prelude::*};

impl Hairdo {
    /// The present hairdo of a [`Hair`](crate::Hair), or of the one that an entity wears: a snapshot of its pose even in motion.
    ///
    /// # Errors
    /// When `hair` is no hair and wears none, or several, when it is on the GPU, or a strand has fewer than two nodes
    /// or invalid numbers.
    pub fn of(world: &World, hair: Entity) -> Result<Self, HairdoError> {
        let hair = the_hair(world, hair)?;
        if is_on_gpu(world, hair) {
            return Err(HairdoError::OnGpu { entity: hair });
        }
        Self::of_strands(world, hair)
    }

    /// Of what its strands hold, wherever it is simulated.
    pub(super) fn of_strands(world: &World, hair: Entity) -> Result<Self, HairdoError> {
        let mut members = members(world, hair);
        members.retain(|member| world.get::<Strand>(*member).is_some());
        let (ties, holds) = holds_of(world, hair, &members);
        let strands = members
            .into_iter()
            .zip(holds)
            .filter_map(|(member, hold)| {
                let strand = &*world.get::<Strand>(member)?.whole();
                let (bonds, water) = (world.get::<Bonds>(member), world.get::<Moisture>(member));
                let cut = world.get::<CutStrand>(member).copied();
                let cut = cut.filter(|cut| cut.fits(strand.nodes()));
                Some(StyledStrand { hold, cut, ..StyledStrand::of(strand, bonds, water) })
            })
            .collect();
        let cuticle = world.get::<Cuticle>(hair).copied();
        let look = world.get::<HairLook>(hair).map(Ranged::clamped);
        let dye = world.get::<HairDye>(hair).map(Ranged::clamped).unwrap_or_default();
        let preset = world.get::<WornPreset>(hair).map(Ranged::clamped);
        let followers = world.get::<FollowerCuts>(hair).cloned().unwrap_or_default();
        Self { strands, cuticle, look, dye, preset, ties, followers }.checked()
    }

    /// Puts the hairdo on a hair of the same groom, or on the one that an entity wears, of several on that of the hairdo's
    /// preset, at rest: all strands, or in case of an error none.
    ///
    /// Strands are cut as they are in the hairdo, or grow back to that. Roots stay where they are; a strand whose root has moved since, as on a skinned mesh, is
    /// moved with it. Acting treatments end, winding on a rod starts again. Ties of the hairdo come as children of the
    /// hair, others let go of its strands; nodes held by [`HeldNodes`] otherwise stay held. Drops stay where they are in the world. Water that the
    /// hairdo adds or the old one removes is entered in the [`WaterLedger`]. Look and dye are put
    /// on too; without a [`look`](Self::look) of the hairdo's own the hair keeps its look.
    ///
    /// In a system use [`Hairdo::apply`], or [`ApplyHairdo`](super::ApplyHairdo) to get an answer.
    ///
    /// # Errors
    /// When `hair` is no hair and wears none, or several of which none alone has the hairdo's preset, or its strands do not
    /// match the hairdo's.
    pub fn apply(&self, world: &mut World, hair: Entity) -> Result<(), HairdoError> {
        let hair = self.its_hair(world, hair)?;
        return_to_cpu(world, hair);
        let mut members = members(world, hair);
        members.retain(|member| world.get::<Strand>(*member).is_some());
        // Strands that have grown alike fit however they are cut.
        let nodes = members.iter().enumerate().map(|(i, member)| {
            let Some(strand) = world.get::<Strand>(*member) else { return 0 };
            let own = self.strands.get(i).filter(|own| own.is_of(strand, world.get(*member)));
            own.map_or_else(|| strand.nodes(), |own| own.positions.len())
        });
        self.check_fit(nodes)?;
        let conditions = WettingConditions {
            wetting: setting(world, hair),
            gravity: (world.get_resource::<HairGravity>()).map_or(0.0, |g| g.clamped().length()),
        };
        let mut added = 0.0;
        for (member, style) in members.iter().zip(&self.strands) {
            added += style.apply(world.entity_mut(*member), &conditions);
        }
        self.hold(world, hair, &members);
        if let Some(mut ledger) = world.get_resource_mut::<WaterLedger>()
            && added != 0.0
        {
            ledger.replace(added);
        }
        let mut hair = world.entity_mut(hair);
        if self.followers.0.is_empty() {
            hair.remove::<FollowerCuts>();
        } else {
            hair.insert(self.followers.clone());
        }
        match self.cuticle {
            Some(cuticle) => hair.insert(cuticle),
            None => hair.remove::<Cuticle>(),
        };
        if let Some(look) = self.look.clone() {
            hair.insert(look);
        }
        if !self.dye.is_none() {
            hair.insert(self.dye.clone());
        } else if hair.contains::<HairDye>() {
            hair.remove::<HairDye>();
        }
        Ok(())
    }

    /// The one hair that an entity is or wears; of several the one of the same preset.
    pub(super) fn its_hair(&self, world: &World, entity: Entity) -> Result<Entity, HairdoError> {
        the_hair(world, entity).or_else(|none_or_several| {
            let preset = |hair: &Entity| world.get::<WornPreset>(*hair).map(|worn| &worn.name);
            let own = self.preset.as_ref().map(|own| &own.name);
            let mut same = hairs_of(world, entity);
            same.retain(|hair| own.is_some() && preset(hair) == own);
            match same[..] {
                [hair] => Ok(hair),
                _ => Err(none_or_several),
            }
        })
    }

    /// [`Hairdo::apply`] as an entity command. Errors are reported as a [`HairFault`].
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// #[derive(Resource)]
    /// struct BestHairdo(Hairdo);
    ///
    /// fn to_the_ball(In(character): In<Entity>, mut commands: Commands, best: Res<BestHairdo>) {
    ///     commands.entity(character).queue(best.0.clone().into_command());
    /// }
    /// ```
    pub fn into_command(self) -> impl EntityCommand<Out = ()> {
        command(move |world, hair| self.apply(world, hair))
    }

    /// [`Hairdo::apply`] as an entity command where the hair has as many strands and nodes, else
    /// [`Hairdo::apply_resampled`]. Errors are reported as a [`HairFault`].
    pub fn into_fitting_command(self) -> impl EntityCommand<Out = ()> {
        command(move |world, hair| self.apply_fitting(world, hair))
    }

    /// [`Hairdo::apply`] where the hair has as many strands and nodes, else
    /// [`Hairdo::apply_resampled`].
    pub(super) fn apply_fitting(&self, world: &mut World, hair: Entity) -> Result<(), HairdoError> {
        match self.apply(world, hair) {
            Err(HairdoError::Strands { .. } | HairdoError::Nodes { .. }) => {
                self.apply_resampled(world, hair)
            }
            applied => applied,
        }
    }

    /// [`Hairdo::apply_resampled`] as an entity command. Errors are reported as a [`HairFault`].
    pub fn into_resampled_command(self) -> impl EntityCommand<Out = ()> {
        command(move |world, hair| self.apply_resampled(world, hair))
    }
}

fn command(
    act: impl FnOnce(&mut World, Entity) -> Result<(), HairdoError> + Send + 'static,
) -> impl EntityCommand<Out = ()> {
    move |hair: EntityWorldMut<'_>| {
        let entity = hair.id();
        let world = hair.into_world_mut();
        if let Err(wrong) = act(world, entity) {
            report(world, entity, wrong);
        }
    }
}

pub(super) fn report(world: &mut World, hair: Entity, wrong: HairdoError) {
    let outcome = "the hair keeps the hairdo that it has";
    world.write_message(HairFault::caused(FaultKind::Hairdo, wrong, outcome).of(hair));
}

/// The one hair that an entity is or wears.
fn the_hair(world: &World, entity: Entity) -> Result<Entity, HairdoError> {
    let hairs = hairs_of(world, entity);
    match hairs[..] {
        [hair] => Ok(hair),
        [] => Err(HairdoError::NoHair { entity }),
        _ => Err(HairdoError::SeveralHairs { entity, hairs }),
    }
}

pub(super) fn members(world: &World, hair: Entity) -> Vec<Entity> {
    world.get::<Strands>(hair).into_iter().flat_map(Strands::iter).collect()
}

fn setting<T: HairSetting>(world: &World, hair: Entity) -> T {
    let default = world.get_resource::<HairDefault<T>>().map(|default| &default.0);
    let own = world.get::<T>(hair).or(default);
    own.cloned().unwrap_or_default().clamped()
}

/// Settings that determine how wet hair with some water is.
struct WettingConditions {
    wetting: HairWetting,
    /// Strength of gravity (m/s²).
    gravity: f32,
}

impl StyledStrand {
    fn of(strand: &Strand, bonds: Option<&Bonds>, water: Option<&Moisture>) -> Self {
        // Bonds that do not match the strand would be replaced in the next tick.
        let bonds = bonds.filter(|bonds| bonds.joints.len() == strand.edges());
        let joints = bonds.map_or_else(|| Bonds::of(strand).joints, |bonds| bonds.joints.clone());
        let water = water.filter(|water| !water.is_untouched());
        let fitted = |water: &[f64]| {
            let mut water = water.to_vec();
            water.resize(strand.nodes(), 0.0);
            water
        };
        Self {
            positions: strand.positions().to_vec(),
            orientations: strand.orientations().to_vec(),
            rest_lengths: strand.rest_lengths().to_vec(),
            root_frame: strand.root_frame(),
            joints,
            film: water.map(|water| fitted(water.film())).unwrap_or_default(),
            bound: water.map(|water| fitted(water.bound())).unwrap_or_default(),
            hold: None,
            cut: None,
        }
    }

    /// The same moved to another root.
    fn rooted(&self, place: Vec3, frame: Quat) -> Self {
        let mut moved = self.clone();
        if (place, frame) != (self.positions[0], self.root_frame)
            && place.is_finite()
            && frame.is_finite()
        {
            let turn = (frame * self.root_frame.inverse()).normalize();
            moved.positions.iter_mut().for_each(|p| *p = place + turn * (*p - self.positions[0]));
            moved.orientations.iter_mut().for_each(|q| *q = (turn * *q).normalize());
            moved.root_frame = frame;
        }
        moved
    }

    /// Gives a strand of as many nodes this style, at rest. Returns how much more water it has (m³).
    fn apply(&self, mut entity: EntityWorldMut<'_>, around: &WettingConditions) -> f64 {
        let placed = entity.get_mut::<Strand>().map(|mut strand| {
            let root = strand.positions().first().copied().unwrap_or_default();
            let Self { positions, orientations, rest_lengths, root_frame, .. } =
                self.rooted(root, strand.root_frame());
            strand.replace(positions.clone(), orientations, rest_lengths, root_frame);
            positions
        });
        match self.cut {
            Some(cut) => entity.insert(cut),
            None => entity.remove::<CutStrand>(),
        };
        // Without this it would be drawn interpolated across the jump.
        if let Some(mut history) = entity.get_mut::<StrandHistory>() {
            history.positions = placed.unwrap_or_default();
        }
        if let Some(mut bonds) = entity.get_mut::<Bonds>() {
            bonds.joints.clone_from(&self.joints);
        }
        // Running treatments belong to the replaced hairdo.
        fn reset<T: Component<Mutability = bevy::ecs::component::Mutable> + Default>(
            entity: &mut EntityWorldMut<'_>,
        ) {
            if let Some(mut state) = entity.get_mut::<T>() {
                *state = T::default();
            }
        }
        reset::<BondChanges>(&mut entity);
        reset::<RestShape>(&mut entity);
        reset::<Treatments>(&mut entity);
        reset::<AddedMass>(&mut entity);
        if entity.contains::<WoundOn>() {
            reset::<WindingProgress>(&mut entity);
            reset::<HeldNodes>(&mut entity);
        }
        entity.get_mut::<Moisture>().map_or(0.0, |mut water| {
            let WettingConditions { wetting, gravity } = around;
            water.replace(&self.film, &self.bound, &self.rest_lengths, wetting, *gravity)
        })
    }
}
