//! Styles: how much of a styled shape is left, and queries of hair's state for games.
//!
//! Put [`HairStyle`] on a [`Hair`] once it is styled. From then on [`KeptStyle`] holds how much of that
//! style is left, as defined in `model.rs`, and [`StyleFaded`] is triggered when too much is lost, be it
//! by washing, rain, sleep or steam.

mod model;

use crate::{
    base::{
        schedule::{HairSystems, HairTick, lacks, last_substep},
        setting::{Ranged, Settings, setting},
    },
    forces::environment::vapour::WATER,
    hair::{
        strand::{Hair, Strands, lacks_strands},
        worn::{self, HairsOf, WornBy},
    },
    keratin::bond::{BondInfluence, BondPlugin, Bonds},
    water::Moisture,
};
use bevy::{ecs::system::SystemParam, prelude::*};
use model::{KeptSum, styled};

/// Measures styles.
#[derive(Clone, Copy, Debug, Default)]
pub struct StylePlugin;

impl Plugin for StylePlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        lacks::<BondPlugin, Self>(app);
        worn::component::<HairStyle>(app);
        app.register_type::<KeptStyle>()
            .register_type::<StyledJoints>()
            .register_type::<StyleFaded>()
            .add_systems(HairTick, measure_styles.in_set(HairSystems::Styles).run_if(last_substep));
    }
}

setting! {
    /// Takes the shape in which a hair's bonds hold it now as its style, and measures from then on
    /// how much of it is left. Component of a [`Hair`] or its wearer; insert it again when the hair has been
    /// restyled: soaked ([`SoakHair`](crate::SoakHair)) and dried in shape
    /// ([`HairDried`](crate::HairDried)). On wet hair, whose hydrogen bonds are open, it cannot see what
    /// they will hold. Costs a pass over all joints once a tick.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// fn styled(In(character): In<Entity>, mut commands: Commands) {
    ///     commands.entity(character).insert(HairStyle::default()).observe(|faded: On<StyleFaded>| {
    ///         info!("only {:.0} % of the curls are left", 100.0 * faded.kept);
    ///     });
    /// }
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(KeptStyle)]
    pub struct HairStyle {
        /// [`StyleFaded`] is triggered when less than this share of the style is left.
        pub fades_below: f32 = 0.5, in FADES_BELOW: 0.0..=1.0, safe 0.1..=0.9, "half of it is 0.5";
    }
}

/// How much of its [`HairStyle`] a hair has kept. Written by the tick.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct KeptStyle {
    share: Option<f32>,
    faded: bool,
}

/// The style of a strand's joints.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(storage = "SparseSet")]
#[reflect(Component, Default, Clone)]
pub(crate) struct StyledJoints(pub(crate) Vec<Vec3>);

impl KeptStyle {
    /// The share that is left: 1 when inserted, 0 when nothing is left, negative when hair bends
    /// the other way. `None` before the first tick, and where bonds held hair in its natural shape
    /// when [`HairStyle`] was inserted: style the hair, then insert it again.
    pub fn kept(&self) -> Option<f32> {
        self.share
    }
}

/// Triggered on a [`Hair`] when less of its [`HairStyle`] is left than
/// [`fades_below`](HairStyle::fades_below): once, and again after restyling or recovery. Then on its wearer
/// ([`WornBy`]). An observer of the whole app sees both; `On::original_event_target` is the hair.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[entity_event(propagate = &'static WornBy, auto_propagate)]
#[reflect(Clone, PartialEq)]
pub struct StyleFaded {
    /// The hair, or its wearer.
    pub entity: Entity,
    /// The share of the style that is left.
    pub kept: f32,
}

/// How far above its limit a style has to recover before it can fade again.
const BACK_BY: f32 = 0.05;

fn measure_styles(
    influence: Settings<BondInfluence>,
    mut hairs: Query<(Entity, Ref<HairStyle>, &Strands, &mut KeptStyle), With<Hair>>,
    strands: Query<(Entity, &Bonds, Option<&StyledJoints>)>,
    mut commands: Commands,
) {
    for (hair, style, members, mut kept) in &mut hairs {
        let influence = influence.of(hair).as_array();
        // A copy, and what a scene brings, keeps what it was styled to.
        let is_copy = kept.is_added() && kept.share.is_some();
        let kept = kept.bypass_change_detection();
        let joints = |bonds: &Bonds| -> Vec<Vec3> {
            bonds.joints.iter().map(|joint| styled(joint, &influence)).collect()
        };
        let mut sum = KeptSum::default();
        // In the order of the strands, for determinism.
        let all = strands.iter_many(members.iter());
        if style.is_changed() && !is_copy {
            kept.faded = false;
            let styles: Vec<_> = all.map(|(id, bonds, _)| (id, joints(bonds))).collect();
            styles.iter().flat_map(|(_, joints)| joints).for_each(|joint| sum.add(*joint, *joint));
            kept.share = sum.kept();
            for (id, joints) in styles {
                let mut strand = commands.entity(id);
                if kept.share.is_some() {
                    strand.try_insert(StyledJoints(joints));
                } else if strands.get(id).is_ok_and(|strand| strand.2.is_some()) {
                    strand.try_remove::<StyledJoints>();
                }
            }
        } else if kept.share.is_some() {
            for (_, bonds, styles) in all {
                let Some(StyledJoints(styles)) = styles else { continue };
                for (style, joint) in styles.iter().zip(&bonds.joints) {
                    sum.add(*style, styled(joint, &influence));
                }
            }
            kept.share = sum.kept();
        } else {
            // Hair without a style costs nothing more.
            continue;
        }
        let limit = style.clamped().fades_below;
        match kept.share {
            Some(share) if share < limit && !kept.faded => {
                kept.faded = true;
                commands.trigger(StyleFaded { entity: hair, kept: share });
            }
            Some(share) if share >= limit + BACK_BY => kept.faded = false,
            _ => {}
        }
    }
}

/// System parameter with queries of the state of a hair, or of all that a character wears.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn towel_needed(In(character): In<Entity>, condition: HairCondition) -> bool {
///     condition.wetness(character) > 0.3
/// }
/// ```
#[derive(SystemParam)]
pub struct HairCondition<'w, 's> {
    of: HairsOf<'w, 's>,
    hairs: Query<'w, 's, &'static Strands>,
    moistures: Query<'w, 's, &'static Moisture>,
    kept: Query<'w, 's, &'static KeptStyle>,
}

impl HairCondition<'_, '_> {
    /// The strands of a hair or a wearer.
    fn strands(&self, of: &Entity) -> Vec<Entity> {
        let hairs = self.of.of(of).iter().filter_map(|hair| self.hairs.get(*hair).ok());
        hairs.flat_map(|members| members.iter()).collect()
    }

    /// Mean wetness inside a hair over all nodes: 0 as in a room, 1 as under water. 0 for an entity that
    /// is no hair and wears none.
    pub fn wetness(&self, hair: Entity) -> f32 {
        let (mut sum, mut strands) = (0.0, 0);
        for id in self.strands(&hair) {
            strands += 1;
            let Ok(moisture) = self.moistures.get(id) else { continue };
            let nodes = moisture.wetness();
            sum += nodes.iter().map(|w| f64::from(*w)).sum::<f64>() / nodes.len().max(1) as f64;
        }
        (sum / f64::from(strands.max(1))) as f32
    }

    /// The water on and in a hair, beyond the regain of a room (kg).
    pub fn water(&self, hair: Entity) -> f64 {
        let of =
            |moisture: &Moisture| -> f64 { moisture.film().iter().chain(moisture.bound()).sum() };
        let all = self.strands(&hair).into_iter();
        let all = all.filter_map(|id| self.moistures.get(id).ok()).map(of);
        // An empty `sum` is −0.
        all.fold(0.0_f64, |sum, volume| sum + volume) * WATER
    }

    /// How much of its style a hair has kept, see [`KeptStyle::kept`]; of several on a wearer the least.
    pub fn kept_style(&self, hair: Entity) -> Option<f32> {
        let hairs = self.of.of(&hair).iter();
        hairs.filter_map(|hair| self.kept.get(*hair).ok()?.kept()).reduce(f32::min)
    }
}
