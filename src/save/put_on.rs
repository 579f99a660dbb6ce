//! Taking a hairdo from a hair in the world, and putting it on.

use super::{Hairdo, HairdoError, StyledStrand};
use crate::{
    bond::{BondChanges, Bonds, Cuticle, RestShape},
    environment::HairGravity,
    fault::{FaultKind, HairFault},
    setting::{HairDefault, HairSetting, Ranged},
    strand::{AddedMass, Hair, HeldNodes, Strand, StrandHistory, Strands},
    treatment::{Treatments, WindingProgress, WoundOn},
    water::{Moisture, WaterLedger, Wetting},
};
use bevy::{ecs::system::EntityCommand, prelude::*};

impl Hairdo {
    /// The present hairdo of a [`Hair`]. Hair that moves is caught in its motion.
    ///
    /// # Errors
    /// When `hair` is no hair, or a strand has fewer than two nodes or numbers that cannot be.
    pub fn of(world: &World, hair: Entity) -> Result<Self, HairdoError> {
        let strands = members(world, hair)?
            .into_iter()
            .filter_map(|member| {
                let strand = world.get::<Strand>(member)?;
                let (bonds, water) = (world.get::<Bonds>(member), world.get::<Moisture>(member));
                Some(StyledStrand::of(strand, bonds, water))
            })
            .collect();
        let cuticle = world.get::<Cuticle>(hair).copied();
        Self { strands, cuticle }.checked()
    }

    /// Puts the hairdo on a hair of the same groom, at rest: all strands, or in case of an error
    /// none.
    ///
    /// Roots stay where they are; a strand whose root has moved since, as on a skinned mesh, is
    /// taken along. Treatments that were still acting end, winding on a rod begins anew, nodes held
    /// by [`HeldNodes`] otherwise stay held. Drops stay where they are in the world. Water that comes
    /// with the hairdo, or goes with the old one, is booked in the [`WaterLedger`].
    ///
    /// In a system use [`Hairdo::put_on`].
    ///
    /// # Errors
    /// When `hair` is no hair, or has other strands than the hairdo.
    pub fn apply(&self, world: &mut World, hair: Entity) -> Result<(), HairdoError> {
        let mut members = members(world, hair)?;
        members.retain(|member| world.get::<Strand>(*member).is_some());
        let nodes = members.iter().map(|m| world.get::<Strand>(*m).map_or(0, Strand::nodes));
        self.must_fit(nodes)?;
        let surroundings = Surroundings {
            wetting: setting(world, hair),
            gravity: (world.get_resource::<HairGravity>()).map_or(0.0, |g| g.clamped().length()),
        };
        let mut came = 0.0;
        for (member, style) in members.into_iter().zip(&self.strands) {
            came += style.put_on(world.entity_mut(member), &surroundings);
        }
        if let Some(mut ledger) = world.get_resource_mut::<WaterLedger>()
            && came != 0.0
        {
            ledger.replace(came);
        }
        let mut hair = world.entity_mut(hair);
        match self.cuticle {
            Some(cuticle) => hair.insert(cuticle),
            None => hair.remove::<Cuticle>(),
        };
        Ok(())
    }

    /// [`Hairdo::apply`] as an entity command. What is wrong is told as a [`HairFault`].
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// #[derive(Resource)]
    /// struct BestHairdo(Hairdo);
    ///
    /// fn to_the_ball(mut commands: Commands, hair: Single<Entity, With<Hair>>, best: Res<BestHairdo>) {
    ///     commands.entity(*hair).queue(best.0.clone().put_on());
    /// }
    /// ```
    pub fn put_on(self) -> impl EntityCommand<Out = ()> {
        command(move |world, hair| self.apply(world, hair))
    }

    /// [`Hairdo::apply`] as an entity command where the hair has as many strands and nodes, else
    /// [`Hairdo::apply_resampled`]. What is wrong is told as a [`HairFault`].
    pub fn put_on_fitting(self) -> impl EntityCommand<Out = ()> {
        command(move |world, hair| match self.apply(world, hair) {
            Err(HairdoError::Strands { .. } | HairdoError::Nodes { .. }) => {
                self.apply_resampled(world, hair)
            }
            applied => applied,
        })
    }

    /// [`Hairdo::apply_resampled`] as an entity command. What is wrong is told as a [`HairFault`].
    pub fn put_on_resampled(self) -> impl EntityCommand<Out = ()> {
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
            world.write_message(
                HairFault::caused(
                    FaultKind::Hairdo,
                    wrong,
                    "the hair keeps the hairdo that it has",
                )
                .of(entity),
            );
        }
    }
}

fn members(world: &World, hair: Entity) -> Result<Vec<Entity>, HairdoError> {
    world.get::<Hair>(hair).ok_or(HairdoError::NoHair { entity: hair })?;
    Ok(world.get::<Strands>(hair).into_iter().flat_map(Strands::iter).collect())
}

fn setting<T: HairSetting>(world: &World, hair: Entity) -> T {
    let default = world.get_resource::<HairDefault<T>>().map(|default| &default.0);
    let own = world.get::<T>(hair).or(default);
    own.cloned().unwrap_or_default().clamped()
}

/// What decides how wet hair with some water is.
struct Surroundings {
    wetting: Wetting,
    /// Strength of gravity (m/s²).
    gravity: f32,
}

impl StyledStrand {
    fn of(strand: &Strand, bonds: Option<&Bonds>, water: Option<&Moisture>) -> Self {
        // What the next tick would make of it.
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
        }
    }

    /// The same with its root elsewhere.
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
    fn put_on(&self, mut entity: EntityWorldMut<'_>, around: &Surroundings) -> f64 {
        let placed = entity.get_mut::<Strand>().map(|mut strand| {
            let root = strand.positions().first().copied().unwrap_or_default();
            let Self { positions, orientations, rest_lengths, root_frame, .. } =
                self.rooted(root, strand.root_frame());
            strand.replace(positions.clone(), orientations, rest_lengths, root_frame);
            positions
        });
        // Drawn between the tick before and now, it would streak across.
        if let Some(mut history) = entity.get_mut::<StrandHistory>() {
            history.positions = placed.unwrap_or_default();
        }
        if let Some(mut bonds) = entity.get_mut::<Bonds>() {
            bonds.joints.clone_from(&self.joints);
        }
        // What was under way belongs to the hairdo that goes.
        fn forget<T: Component<Mutability = bevy::ecs::component::Mutable> + Default>(
            entity: &mut EntityWorldMut<'_>,
        ) {
            if let Some(mut state) = entity.get_mut::<T>() {
                *state = T::default();
            }
        }
        forget::<BondChanges>(&mut entity);
        forget::<RestShape>(&mut entity);
        forget::<Treatments>(&mut entity);
        forget::<AddedMass>(&mut entity);
        if entity.contains::<WoundOn>() {
            forget::<WindingProgress>(&mut entity);
            forget::<HeldNodes>(&mut entity);
        }
        entity.get_mut::<Moisture>().map_or(0.0, |mut water| {
            let Surroundings { wetting, gravity } = around;
            water.replace(&self.film, &self.bound, &self.rest_lengths, wetting, *gravity)
        })
    }
}
