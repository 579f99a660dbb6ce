//! Which strands are drawn of a hair and which guides they follow, looked up anew: for what cuts or writes them.

use super::{
    curve::Guide,
    draw::{Packed, guide_root},
    drawn_strand::{DrawnStrand, GuideEnd, GuideRoot},
    follower_roots::FollowerRoots,
    followers::HairFollowers,
    scatter::{scatter, shorten},
};
use crate::{
    base::setting::Settings,
    hair::strand::{CutStrand, FollowerCuts, Hair, Strand, Strands},
    water::Moisture,
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// Guides and drawn strands of hair.
#[derive(SystemParam)]
pub(crate) struct PresentHair<'w, 's> {
    hairs: Query<
        'w,
        's,
        (
            Option<&'static Packed>,
            &'static Strands,
            Option<&'static FollowerRoots>,
            Option<&'static FollowerCuts>,
        ),
        With<Hair>,
    >,
    strands:
        Query<'w, 's, (&'static Strand, Option<&'static CutStrand>, Option<&'static Moisture>)>,
    followers: Settings<'w, 's, HairFollowers>,
}

/// What is drawn of one hair.
pub(super) struct Present<'a> {
    pub(super) guides: Vec<(&'a Strand, Option<&'a CutStrand>, Option<&'a Moisture>)>,
    pub(super) roots: Vec<GuideRoot>,
    pub(super) settings: HairFollowers,
    /// The guides, then the followers.
    pub(super) strands: Vec<DrawnStrand>,
}

impl PresentHair<'_, '_> {
    /// Of a hair that is drawn and whose guides have been cut: as it is drawn from now on, followers whole that have not
    /// been cut themselves.
    pub(super) fn to_cut(&self, hair: Entity) -> Option<Present<'_>> {
        self.hairs.get(hair).ok()?.0?;
        self.of(hair, |packed, follower_roots| packed?.known_roots(follower_roots), true)
    }

    /// Of a hair that has guides. Where no `roots` are known that followers are laid out by, these are where guides grow
    /// now; followers that have not been cut are `whole`, or end as their guides do.
    pub(super) fn of<'a>(
        &'a self,
        hair: Entity,
        roots: impl Fn(Option<&'a Packed>, Option<&FollowerRoots>) -> Option<&'a [GuideRoot]>,
        whole: bool,
    ) -> Option<Present<'a>> {
        let (packed, members, follower_roots, cuts) = self.hairs.get(hair).ok()?;
        let guides = self.strands.iter_many(members.iter()).filter(|guide| guide.0.nodes() > 1);
        let fitting = |(strand, cut, water): (&'a Strand, Option<&'a CutStrand>, _)| {
            (strand, cut.filter(|cut| cut.fits(strand.nodes())), water)
        };
        let guides: Vec<_> = guides.map(fitting).collect();
        if guides.is_empty() {
            return None;
        }
        let known = roots(packed, follower_roots);
        let roots = known.filter(|known| known.len() == guides.len()).map_or_else(
            || guides.iter().map(|(strand, cut, _)| guide_root(strand, *cut)).collect(),
            <[_]>::to_vec,
        );
        let end = |(strand, cut, _): &(&Strand, Option<&CutStrand>, Option<&Moisture>)| {
            cut.map_or_else(|| GuideEnd::whole(strand.nodes() as u32), GuideEnd::from)
        };
        let ends: Vec<GuideEnd> = guides.iter().map(end).collect();
        let settings = self.followers.of(hair);
        let mut strands = scatter(&roots, follower_roots, &settings);
        let followers = strands.len() - ends.len();
        let all_whole = FollowerCuts(vec![u16::MAX; if whole { followers } else { 0 }]);
        let cuts = cuts.filter(|cuts| cuts.0.len() == followers).or(whole.then_some(&all_whole));
        shorten(&mut strands, &ends, cuts);
        Some(Present { guides, roots, settings, strands })
    }
}

impl Present<'_> {
    pub(super) fn guide(&self, index: u32) -> Guide<'_> {
        let (strand, cut, water) = self.guides[index as usize];
        Guide {
            nodes: strand.positions(),
            moisture: water.map_or(&[], Moisture::sheen),
            end: cut.map(GuideEnd::from),
        }
    }
}
