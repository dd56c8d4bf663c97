//! The renderers: which are there, what each is at, and which of them takes a job.

use std::time::{Duration, Instant};

use super::cost::{LARGE, QUICK, SMALL};
use super::homes::Homes;
use super::order::Order;
use super::turns::LESS;
use crate::fair::Waiting;

/// Seconds for a unit of cost until it is known better, of small and of large jobs: those of a software device.
const SECONDS_PER_COST: [f64; 2] = [5e-7, 3e-7];
/// Weight of the latest job in what is known of them.
const LATEST: f64 = 0.2;

/// So long after its first job a server gets renderers beside its main one, before anybody waits for them.
pub(super) const SETTLED: Duration = Duration::from_secs(10);

/// The first renderer, which is made before there are any jobs.
pub(super) const MAIN: usize = 0;
/// The second one.
const SECOND: usize = 1;

/// Which jobs a renderer takes at most, in the order in which they are asked: the later ones while those before are at what takes longer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lane {
    /// All.
    Main,
    /// All but large ones.
    Express,
    /// Small ones.
    Small,
    /// Quick ones.
    Quick,
}

/// The renderers.
#[derive(Debug)]
pub(super) struct Pool {
    renderers: Vec<Renderer>,
    /// How many take jobs that are alike side by side.
    side_by_side: usize,
    homes: Homes,
    /// When the first job began.
    first: Option<Instant>,
    seconds_per_cost: [f64; 2],
    /// The same of small jobs of skies that were new to their renderer.
    seconds_if_new: f64,
}

#[derive(Debug)]
struct Renderer {
    lane: Lane,
    is_made: bool,
    /// Cost of what it is at.
    running: Option<f64>,
    /// It had nothing of that sky.
    is_new: bool,
}

impl Lane {
    /// The cost that a renderer takes at most.
    fn most(self) -> f64 {
        match self {
            Self::Main => f64::INFINITY,
            Self::Express => LARGE,
            Self::Small => SMALL,
            Self::Quick => QUICK,
        }
    }
}

impl Pool {
    /// Renderers of which so many take jobs side by side, once that is allowed, and those beside them.
    pub(super) fn new(side_by_side: usize) -> Self {
        let express = std::iter::repeat_n(Lane::Express, side_by_side.saturating_sub(1).max(1));
        let lanes = std::iter::once(Lane::Main).chain(express).chain([Lane::Small, Lane::Quick]);
        let renderers = lanes.map(|lane| Renderer { lane, is_made: false, running: None, is_new: false }).collect();
        Self {
            renderers,
            side_by_side: 1,
            homes: Homes::default(),
            first: None,
            seconds_per_cost: SECONDS_PER_COST,
            seconds_if_new: SECONDS_PER_COST[0],
        }
    }

    /// How many there may be.
    pub(super) fn count(&self) -> usize {
        self.renderers.len()
    }

    /// From now on so many take jobs that are alike side by side.
    pub(super) fn go_side_by_side(&mut self, count: usize) {
        self.side_by_side = count.min(self.renderers.len() - 2);
    }

    /// A renderer is there, or is not there any more, with all that it kept.
    pub(super) fn has(&mut self, number: usize, is_made: bool) {
        self.renderers[number].is_made = is_made;
        if !is_made {
            self.homes.forget(number);
        }
    }

    /// A renderer is at a job.
    pub(super) fn begin(&mut self, number: usize, one: &Waiting<Order>) {
        let sky = one.item.job.scene_id();
        let is_new = !self.homes.of(sky).contains(&number);
        let renderer = &mut self.renderers[number];
        (renderer.running, renderer.is_new) = (Some(one.cost), is_new);
        self.homes.renders(number, sky, one.item.since.elapsed());
        self.first.get_or_insert_with(Instant::now);
    }

    /// A job has ended after so long; nothing is learnt from one that was stopped.
    pub(super) fn done(&mut self, number: usize, cost: f64, took: Option<Duration>) {
        self.renderers[number].running = None;
        if let Some(took) = took {
            let learn = |known: &mut f64| *known += LATEST * (took.as_secs_f64() / cost.max(1.0) - *known);
            learn(&mut self.seconds_per_cost[usize::from(cost > LARGE)]);
            if self.renderers[number].is_new && cost <= LARGE {
                learn(&mut self.seconds_if_new);
            }
        }
    }

    /// Seconds until what is under way and what waits (its cost together) is done, of small or large jobs.
    pub(super) fn wait_s(&self, is_large: bool, waiting: f64) -> f64 {
        let running = self.renderers.iter().filter_map(|one| one.running);
        let running: f64 = running.filter(|cost| (*cost > LARGE) == is_large).sum();
        let made = self.renderers[..self.side_by_side].iter().filter(|one| one.is_made).count().max(1);
        let share = if is_large { 1.0 } else { made as f64 };
        (running + waiting) * self.seconds_per_cost[usize::from(is_large)] / share
    }

    /// From when on a renderer is to take a job, as things stand; `None` where it is left to others.
    ///
    /// Of those that are free the one takes it that had its sky last, or else has the fewest skies. Where those that have its sky are
    /// at jobs like it, it waits for them until jobs of this sky have waited for as long, all together, as it takes a renderer to which the sky is new: then another one
    /// makes that light again, on a core that has nothing to do.
    pub(super) fn takes_from(&self, number: usize, one: &Waiting<Order>) -> Option<Instant> {
        let open = self.open(false);
        let most = |number: usize| self.renderers[number].lane.most();
        let is_able = |number: usize| open[number] && one.cost <= most(number);
        if !is_able(number) {
            return None;
        }
        let sky = one.item.job.scene_id();
        let homes = self.homes.of(sky);
        let rank = |number: usize| match homes.iter().position(|home| *home == number) {
            Some(place) => (place, 0, number),
            None => (homes.len(), self.homes.count(number), number),
        };
        let own = rank(number);
        let is_free = |other: &usize| {
            let Renderer { is_made, running, .. } = self.renderers[*other];
            is_made && running.is_none()
        };
        let mut others = (0..self.count()).filter(|other| *other != number && is_able(*other));
        if others.any(|other| is_free(&other) && rank(other) < own) {
            return None;
        }
        let is_alike = |running: f64| running <= most(number) && LESS * running < one.cost;
        let is_soon_free = |home: &usize| is_able(*home) && self.renderers[*home].running.is_some_and(is_alike);
        let patience = if !homes.contains(&number) && homes.iter().any(is_soon_free) {
            let anew = Duration::try_from_secs_f64(one.cost * self.seconds_if_new).unwrap_or(Duration::ZERO);
            anew.saturating_sub(self.homes.waited(sky))
        } else {
            Duration::ZERO
        };
        Some(one.item.since + patience)
    }

    /// Whether a renderer that is not there would be of help, where these jobs wait.
    ///
    /// One takes seconds to make, and none that had to be made first would be of help: so the second one is made when a large job runs, it and that of
    /// small ones soon after the start else, that of quick ones, which few servers need, when the first job waits for it, and one more beside the second when a
    /// job finds those before it at work.
    pub(super) fn is_helped<'a>(&self, number: usize, mut waiting: impl Iterator<Item = &'a Waiting<Order>>) -> bool {
        let lane = self.renderers[number].lane;
        let is_settled = self.first.is_some_and(|first| first.elapsed() >= SETTLED);
        let mut is_wanted = || waiting.any(|one| one.cost <= lane.most());
        match lane {
            Lane::Main => true,
            Lane::Express if number > SECOND => {
                let are_busy = self.renderers[..number].iter().all(|one| one.running.is_some());
                number < self.side_by_side && is_settled && are_busy && is_wanted()
            }
            Lane::Express => is_settled || self.renderers[MAIN].running.is_some_and(|cost| cost > LARGE),
            Lane::Small => is_settled || is_wanted() && self.open(true)[number],
            Lane::Quick => is_wanted() && self.open(true)[number],
        }
    }

    /// Which renderers take jobs; `with_all`: which would if all were made. One does while fewer than may go side by side, of those before it that
    /// take jobs, are at what takes no longer than the longest that it takes. The main one is waited for.
    fn open(&self, with_all: bool) -> Vec<bool> {
        let mut open: Vec<bool> = Vec::with_capacity(self.count());
        for renderer in &self.renderers {
            let most = renderer.lane.most();
            let is_alike = |(number, is_open): (usize, &bool)| {
                let Renderer { is_made, running, .. } = self.renderers[number];
                let is_there = is_made || with_all || number == MAIN;
                *is_open && is_there && running.is_none_or(|cost| cost <= most)
            };
            let alike = open.iter().enumerate().filter(|before| is_alike(*before)).count();
            open.push(alike < self.side_by_side);
        }
        open
    }
}
