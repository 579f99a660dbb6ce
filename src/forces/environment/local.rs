//! The air in the frame of a hair: blowers, global wind, zones.

use super::{
    Blower, HairWind, WindZone,
    blown::{Blown, LocalBlower},
    gust::gust,
};
use crate::{
    base::{schedule::HairStep, setting::Ranged, stretch::Stretch},
    hair::strand::{Carried, Pose, TickPose},
};
use bevy::{ecs::system::SystemParam, math::DVec3, prelude::*};

/// Blowers farther away do not act: single precision no longer tells where a strand is in their jets,
/// and farther still its squares overflow (hair's measure).
const FARTHEST: f32 = 1e9;

/// A zone in a hair's frame, with valid values.
pub(super) struct LocalZone {
    zone: WindZone,
    /// Its air moves with it.
    moves: Carried,
    /// Transform from the frame to the zone's, in the zone's metres.
    rotation: Quat,
    origin: Vec3,
    scale: f32,
}

/// All sources of wind in a hair's frame.
#[derive(Default)]
pub(crate) struct LocalWinds {
    pub blowers: Vec<LocalBlower>,
    pub(super) zones: Vec<LocalZone>,
    /// The global wind (m/s).
    pub(super) wind: Vec3,
    pub(super) settings: HairWind,
    /// How far it has travelled so far (m, in the world).
    pub(super) travelled: DVec3,
    pub(super) pose: Pose,
    /// What is added to the air's velocity so that a headwind counts in metres a second at any scale of
    /// the hair, as wind does; zero at scale 1.
    pub(crate) headwind: Vec3,
}

/// How far the wind has travelled (m, in the world), which is where its gusts are. A resource, advanced
/// by each tick; to be saved and restored with the world's time.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct WindTravel(pub DVec3);

/// All sources of wind.
#[derive(SystemParam)]
pub(crate) struct Winds<'w, 's> {
    wind: Option<Res<'w, HairWind>>,
    blowers: Query<'w, 's, (Entity, &'static Blower, &'static TickPose)>,
    zones:
        Query<'w, 's, (Entity, &'static WindZone, &'static Stretch<WindZone>, &'static TickPose)>,
    travel: Option<Res<'w, WindTravel>>,
    step: Res<'w, HairStep>,
}

/// Once a tick: the wind passes.
pub(super) fn travel(wind: Res<HairWind>, time: Res<Time>, mut travel: ResMut<WindTravel>) {
    let seconds = time.delta_secs_f64();
    let way = wind.clamped().velocity.as_dvec3() * seconds;
    travel.0 = if travel.0.is_finite() { travel.0 + way } else { way };
}

/// What acts, in an order that does not change with what else lives in the world.
fn in_order<T>(sources: impl Iterator<Item = (Entity, T)>) -> impl IntoIterator<Item = T> {
    let mut sources: Vec<_> = sources.collect();
    sources.sort_by_key(|(id, _)| id.index_u32());
    sources.into_iter().map(|(_, source)| source)
}

impl Winds<'_, '_> {
    fn wind(&self) -> HairWind {
        self.wind.as_ref().map_or_else(HairWind::default, |wind| wind.clamped())
    }

    /// Whether the air is at rest and equally warm everywhere.
    pub(crate) fn are_still(&self) -> bool {
        self.blowers.is_empty() && self.zones.is_empty() && self.wind().velocity == Vec3::ZERO
    }

    /// Whether any source sets the bonds of dry hair.
    pub(crate) fn dry(&self) -> bool {
        !self.blowers.is_empty() || self.zones.iter().any(|(_, zone, ..)| zone.drying > 0.0)
    }

    /// Seen from a frame.
    pub(crate) fn seen_from(&self, frame: &TickPose) -> LocalWinds {
        let pose = frame.now();
        let blowers = in_order(self.blowers.iter().map(|of| (of.0, of)));
        let blowers = (blowers.into_iter())
            .map(|(_, blower, moved)| (blower.clamped(), moved))
            .filter(|(blower, _)| blower.strength > 0.0)
            .map(|(blower, moved)| {
                let at = moved.now();
                LocalBlower {
                    nozzle: pose.point_in(at.translation),
                    aim: pose.direction_in(at.direction_out(Vec3::NEG_Z)),
                    blower,
                    moves: frame.carried_by(moved),
                }
            })
            .filter(|seen| seen.nozzle.length() < FARTHEST);
        let zones = in_order(self.zones.iter().map(|of| (of.0, of)));
        let zones = zones.into_iter().map(|(_, zone, stretch, moved)| {
            let at = moved.now();
            LocalZone {
                zone: stretch.of(zone),
                moves: frame.carried_by(moved),
                rotation: at.rotation.inverse() * pose.rotation,
                origin: pose.point_in(at.translation),
                scale: pose.scale / at.scale,
            }
        });
        let settings = self.wind();
        let travelled = self.travel.as_ref().map_or(DVec3::ZERO, |travel| travel.0);
        let seconds = f64::from(self.step.dt) * f64::from(self.step.index);
        LocalWinds {
            blowers: blowers.collect(),
            zones: zones.collect(),
            wind: pose.direction_in(settings.velocity),
            settings,
            travelled: travelled + settings.velocity.as_dvec3() * seconds,
            pose: *pose,
            headwind: frame.headwind(),
        }
    }
}

impl LocalWinds {
    /// Whether the air is at rest and equally warm.
    pub(crate) fn are_still(&self) -> bool {
        self.blowers.is_empty() && !self.flows()
    }

    /// Whether there are sources other than blowers.
    pub(crate) fn flows(&self) -> bool {
        self.wind != Vec3::ZERO || !self.zones.is_empty()
    }

    /// The global wind if it is the same everywhere and at all times (m/s).
    #[cfg(feature = "gpu")]
    pub(crate) fn steady_wind(&self) -> Option<Vec3> {
        let is_steady = self.settings.gusts <= 0.0 || self.wind == Vec3::ZERO;
        (is_steady && self.zones.is_empty()).then_some(self.wind)
    }

    /// The global wind with gusts at a point (m/s). A strand uses that at its root, since gusts are
    /// longer than hair.
    pub(super) fn gusty_wind(&self, place: Vec3) -> Vec3 {
        let HairWind { gusts, gust_length, seed, .. } = self.settings;
        if gusts <= 0.0 || self.wind == Vec3::ZERO {
            return self.wind;
        }
        let gust = gust(seed, self.pose.point_out(place), self.travelled, gust_length);
        self.wind + self.pose.direction_in(gust) * (gusts * self.wind.length())
    }

    /// Whether any zone may act within a distance of a point.
    pub(super) fn zones_near(&self, place: Vec3, distance: f32) -> bool {
        self.zones.iter().any(|seen| {
            let apart = place.distance(seen.origin) - distance;
            apart * seen.scale.abs() <= seen.zone.reach()
        })
    }

    /// Adds the zones' air at a point and the part of the global `wind` that they let through.
    fn add_flow(&self, air: &mut Blown, wind: Vec3, p: Vec3) {
        let (mut open, mut flow) = (1.0, Vec3::ZERO);
        // The air of shelters that move, by how much each shelters.
        let (mut carried, mut shelters) = (Vec3::ZERO, 0.0);
        let (mut own_motion, mut unsheltered) = (Vec3::ZERO, 0.0);
        for LocalZone { zone, moves, rotation, origin, scale } in &self.zones {
            let place = *rotation * (p - *origin) * *scale;
            let share = zone.weight(place);
            if share <= 0.0 {
                continue;
            }
            let motion = moves.at(p);
            let shelter = zone.shelter * share;
            open *= 1.0 - shelter;
            (carried, shelters) = (carried + motion * shelter, shelters + shelter);
            own_motion += motion * (share - shelter);
            let own = zone.velocity + place.normalize_or_zero() * zone.outward;
            flow += rotation.inverse() * own * (share * scale.signum());
            unsheltered += share - shelter;
            air.add_warmth(zone.warmth * share);
            air.drying += zone.drying * share;
        }
        let carried = carried * ((1.0 - open) / shelters.max(f32::MIN_POSITIVE));
        // A fan in a car moves with the car's air.
        air.flow_by(wind * open + flow + carried + (own_motion - carried * unsheltered));
    }

    /// The air at a point of an `edge`; `wind` is the global wind with gusts there, `zones` whether any
    /// zone is near.
    pub(super) fn at(&self, wind: Vec3, zones: bool, p: Vec3, edge: Vec3) -> Blown {
        let mut air = Blown::at(&self.blowers, self.pose.size(), p, edge);
        if zones {
            self.add_flow(&mut air, wind, p);
        } else {
            air.flow_by(wind);
        }
        air
    }

    /// The air at a point (m), for small objects such as droplets.
    pub(crate) fn around(&self, p: Vec3) -> Blown {
        self.around_edge(p, Vec3::ZERO)
    }

    /// The air at the start `p` (m) of an `edge`, for single queries.
    pub(crate) fn around_edge(&self, p: Vec3, edge: Vec3) -> Blown {
        self.at(self.gusty_wind(p), !self.zones.is_empty(), p, edge)
    }
}
