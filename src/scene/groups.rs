//! Emissive triangles in groups of neighbours, so that many are told apart at the cost of few.
//!
//! A group is chosen by what it can give somewhere, see [`Beam`]; in the group a triangle is chosen in proportion to flux.

use super::beam::Beam;
use super::choice::Choice;
use super::source::Emitter;
use crate::geometry::kd_order;
use crate::math::DVec3;

/// No more groups than this: a choice asks each of them.
const MOST: usize = 1024;

/// The groups of all emitters.
#[derive(Clone, Debug, Default)]
pub struct Groups {
    beams: Vec<Beam>,
    /// Numbers of the emitters, group by group.
    members: Vec<u32>,
    /// The choice of a member in proportion to flux, in the order of `members`.
    by_flux: Choice,
    /// Where an emitter stands in `members`.
    place: Vec<u32>,
    /// Members of a group; the last may have fewer.
    size: usize,
}

impl Groups {
    /// The groups of `emitters`.
    pub(super) fn new(emitters: &[Emitter]) -> Groups {
        let middles: Vec<_> = emitters.iter().map(|e| e.corners.iter().sum::<DVec3>() / 3.0).collect();
        let members = kd_order(&middles);
        let size = members.len().div_ceil(MOST).max(1);
        let beam = |group: &[u32]| Beam::of_emitters(&group.iter().map(|&i| &emitters[i as usize]).collect::<Vec<_>>());
        let beams = members.chunks(size).map(beam).collect();
        let by_flux = Choice::by_flux(members.iter().map(|&i| emitters[i as usize].flux()));
        let mut place = vec![0; members.len()];
        members.iter().enumerate().for_each(|(at, &i)| place[i as usize] = at as u32);
        Groups { beams, members, by_flux, place, size }
    }

    /// A bound of the light of each group.
    pub fn beams(&self) -> &[Beam] {
        &self.beams
    }

    /// The number of the emitter that `u` in [0, 1) chooses, its group as `among` says, with its probability.
    pub fn choose(&self, among: &Choice, u: f64) -> (usize, f64) {
        let (group, share) = among.choose(u);
        let (first, last) = (group * self.size, ((group + 1) * self.size).min(self.members.len()) - 1);
        let (from, to) = (self.by_flux.before(first), self.by_flux.before(last + 1));
        let place = self.by_flux.at(from + share * (to - from)).clamp(first, last);
        let number = self.members[place] as usize;
        (number, self.probability(among, number))
    }

    /// Probability with which the emitter with this number is chosen.
    pub fn probability(&self, among: &Choice, number: usize) -> f64 {
        let place = self.place[number] as usize;
        let group = place / self.size;
        let (first, end) = (group * self.size, ((group + 1) * self.size).min(self.members.len()));
        // The difference of running sums has no digits left where one is faint beside all others.
        if end - first == 1 {
            return among.probability(group);
        }
        let of_group = self.by_flux.before(end) - self.by_flux.before(first);
        among.probability(group) * self.by_flux.weight(place) / of_group
    }
}
