//! The air as seen from a hair: blowers, the wind of the place, zones.

use super::{
    Blower, Wind, WindZone,
    blown::{Blown, LocalBlower},
    gust::gust,
};
use crate::{
    schedule::HairStep,
    setting::Ranged,
    strand::{Pose, TickPose},
};
use bevy::{ecs::system::SystemParam, math::DVec3, prelude::*};

/// A zone as seen from a frame, its values valid.
pub(super) struct LocalZone {
    zone: WindZone,
    /// From the frame to the zone's, in metres of the zone.
    rotation: Quat,
    origin: Vec3,
    scale: f32,
}

/// All that moves the air, seen in a frame.
#[derive(Default)]
pub(crate) struct LocalWinds {
    pub blowers: Vec<LocalBlower>,
    pub(super) zones: Vec<LocalZone>,
    /// The wind of the place (m/s).
    pub(super) wind: Vec3,
    pub(super) settings: Wind,
    /// How far it has come by now (m, in the world).
    pub(super) come: DVec3,
    pub(super) pose: Pose,
}

/// All that moves the air.
#[derive(SystemParam)]
pub(crate) struct Winds<'w, 's> {
    wind: Option<Res<'w, Wind>>,
    blowers: Query<'w, 's, (&'static Blower, &'static TickPose)>,
    zones: Query<'w, 's, (&'static WindZone, &'static TickPose)>,
    time: Res<'w, Time>,
    step: Res<'w, HairStep>,
}

impl Winds<'_, '_> {
    fn wind(&self) -> Wind {
        self.wind.as_ref().map_or_else(Wind::default, |wind| wind.clamped())
    }

    /// Whether no air moves anywhere, and none is warmer than elsewhere.
    pub(crate) fn are_still(&self) -> bool {
        self.blowers.is_empty() && self.zones.is_empty() && self.wind().velocity == Vec3::ZERO
    }

    /// Whether there is anything that sets hair which is not wet.
    pub(crate) fn dry(&self) -> bool {
        !self.blowers.is_empty() || self.zones.iter().any(|(zone, _)| zone.drying > 0.0)
    }

    /// Seen in the frame of `pose`.
    pub(crate) fn seen_from(&self, pose: &Pose) -> LocalWinds {
        let blowers = (self.blowers.iter())
            .map(|(blower, at)| (blower.clamped(), at.now()))
            .filter(|(blower, _)| blower.strength > 0.0)
            .map(|(blower, at)| LocalBlower {
                nozzle: pose.point_in(at.translation),
                aim: pose.direction_in(at.rotation * Vec3::NEG_Z),
                blower,
            });
        let zones = self.zones.iter().map(|(zone, at)| {
            let at = at.now();
            LocalZone {
                zone: zone.clamped(),
                rotation: at.rotation.inverse() * pose.rotation,
                origin: pose.point_in(at.translation),
                scale: pose.scale / at.scale,
            }
        });
        let settings = self.wind();
        let seconds =
            self.time.elapsed_secs_f64() + f64::from(self.step.dt) * f64::from(self.step.index);
        LocalWinds {
            blowers: blowers.collect(),
            zones: zones.collect(),
            wind: pose.direction_in(settings.velocity),
            settings,
            come: settings.velocity.as_dvec3() * seconds,
            pose: *pose,
        }
    }
}

impl LocalWinds {
    /// Whether no air moves, and none is warmer than elsewhere.
    pub(crate) fn are_still(&self) -> bool {
        self.blowers.is_empty() && !self.flows()
    }

    /// Whether there is more than blowers.
    pub(crate) fn flows(&self) -> bool {
        self.wind != Vec3::ZERO || !self.zones.is_empty()
    }

    /// The wind of the place with its gusts near a place: of a strand at its root, for gusts are longer
    /// than hair (m/s).
    pub(super) fn gusty(&self, place: Vec3) -> Vec3 {
        let Wind { gusts, gust_length, seed, .. } = self.settings;
        if gusts <= 0.0 || self.wind == Vec3::ZERO {
            return self.wind;
        }
        let gust = gust(seed, self.pose.point_out(place), self.come, gust_length);
        self.wind + self.pose.direction_in(gust) * (gusts * self.wind.length())
    }

    /// The zones that may be felt within a distance of a place.
    pub(super) fn zones_near(&self, place: Vec3, distance: f32) -> bool {
        self.zones.iter().any(|seen| {
            let apart = place.distance(seen.origin) - distance;
            apart * seen.scale <= seen.zone.reach()
        })
    }

    /// Adds the zones' air at a place to what is there of the `wind` of the place.
    fn add_flow(&self, air: &mut Blown, wind: Vec3, p: Vec3) {
        let (mut open, mut flow) = (1.0, Vec3::ZERO);
        for LocalZone { zone, rotation, origin, scale } in &self.zones {
            let place = *rotation * (p - *origin) * *scale;
            let share = zone.share(place);
            if share <= 0.0 {
                continue;
            }
            open *= 1.0 - zone.shelter * share;
            let own = zone.velocity + place.normalize_or_zero() * zone.outward;
            flow += rotation.inverse() * own * share;
            air.add_warmth(zone.warmth * share);
            air.drying += zone.drying * share;
        }
        air.flow = wind * open + flow;
        air.velocity += air.flow;
    }

    /// The air at a place of an `edge`, where the wind of the place with its gusts is `wind`; `zones` says
    /// whether any is near.
    pub(super) fn at(&self, wind: Vec3, zones: bool, p: Vec3, edge: Vec3) -> Blown {
        let mut air = Blown::at(&self.blowers, self.pose.scale, p, edge);
        if zones {
            self.add_flow(&mut air, wind, p);
        } else {
            air.flow = wind;
            air.velocity += wind;
        }
        air
    }

    /// The air around a small thing (m).
    pub(crate) fn around(&self, p: Vec3) -> Blown {
        self.at(self.gusty(p), !self.zones.is_empty(), p, Vec3::ZERO)
    }
}
