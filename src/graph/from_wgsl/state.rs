//! What the ways through a function have in common: variables, and where they went.
//!
//! Ways that leave early are kept aside: what is returned in [`State::result`], and the variables where they left in
//! [`Exit`]s; what the rest of the block does on those ways does not count.

use super::truth::Truth;
use super::value::Value;
use std::cell::Cell;
use std::rc::Rc;

/// What can still happen, and to which variables.
#[derive(Clone)]
pub struct State {
    /// The variables of all functions that are being called.
    pub slots: Vec<Value>,
    /// Where the function still runs.
    pub live: Truth,
    /// What was returned where it was.
    pub result: Option<Value>,
    /// The ways that returned, and the callers' variables there, which pointers may have changed.
    pub returned: Option<Exit>,
    /// How many variables are the callers'.
    pub callers: usize,
    /// The ways that left the loop or `switch`, and those that go on to the next iteration.
    pub broken: Option<Exit>,
    pub continued: Option<Exit>,
    /// Operations so far, on all ways.
    pub made: Rc<Cell<usize>>,
}

/// Where something was left, and the variables there.
#[derive(Clone)]
pub struct Exit {
    pub taken: Truth,
    slots: Vec<Value>,
}

fn choose_all(truth: &Truth, yes: &[Value], no: &[Value], made: &Cell<usize>) -> Vec<Value> {
    yes.iter().zip(no).map(|(yes, no)| Value::choose(truth, yes, no, made)).collect()
}

impl State {
    /// At the beginning of a function, with the variables of its callers.
    pub fn new(slots: Vec<Value>, made: Rc<Cell<usize>>) -> Self {
        Self {
            callers: slots.len(),
            slots,
            live: Truth::Known(true),
            result: None,
            returned: None,
            broken: None,
            continued: None,
            made,
        }
    }

    pub fn is_dead(&self) -> bool {
        self.live.known() == Some(false)
    }

    /// An exit with the live ways where `taken` holds added.
    pub fn with_exit(&self, exit: Option<Exit>, taken: &Truth) -> Option<Exit> {
        let own = self.live.and(taken);
        Some(match exit {
            None => Exit { taken: own, slots: self.slots.clone() },
            Some(exit) => Exit {
                slots: choose_all(&own, &self.slots, &exit.slots, &self.made),
                taken: exit.taken.or(&own),
            },
        })
    }

    /// Leaves the function.
    pub fn leave_function(&mut self) {
        let exit = self.returned.take();
        self.returned = self.with_exit(exit, &Truth::Known(true));
        if let Some(exit) = &mut self.returned {
            exit.slots.truncate(self.callers);
        }
        self.live = Truth::Known(false);
    }

    /// The callers' variables behind the function, on all ways through it.
    pub fn into_callers(mut self) -> (Vec<Value>, Option<Value>) {
        self.slots.truncate(self.callers);
        let returned = self.returned.take();
        self.rejoin(returned);
        (self.slots, self.result)
    }

    /// Leaves the loop or `switch` where `taken` holds.
    pub fn leave(&mut self, taken: &Truth) {
        if taken.known() == Some(false) {
            return;
        }
        let exit = self.broken.take();
        self.broken = self.with_exit(exit, taken);
        self.live = self.live.and(&taken.not());
    }

    /// Goes on with the ways of `exit`, too.
    pub fn rejoin(&mut self, exit: Option<Exit>) {
        let Some(exit) = exit else { return };
        self.slots = if self.is_dead() {
            exit.slots
        } else {
            choose_all(&exit.taken, &exit.slots, &self.slots, &self.made)
        };
        self.live = self.live.or(&exit.taken);
    }

    /// Both ways of a condition together.
    pub fn join(truth: &Truth, yes: Self, no: Self) -> Self {
        let made = yes.made.clone();
        let both = |yes: Option<Exit>, no: Option<Exit>| match (yes, no) {
            (Some(yes), Some(no)) => Some(Exit {
                taken: truth.choose(&yes.taken, &no.taken),
                slots: choose_all(truth, &yes.slots, &no.slots, &made),
            }),
            (Some(yes), None) => Some(Exit { taken: truth.and(&yes.taken), ..yes }),
            (None, Some(no)) => Some(Exit { taken: truth.not().and(&no.taken), ..no }),
            (None, None) => None,
        };
        Self {
            live: truth.choose(&yes.live, &no.live),
            slots: match (yes.is_dead(), no.is_dead()) {
                (true, _) => no.slots,
                (_, true) => yes.slots,
                _ => choose_all(truth, &yes.slots, &no.slots, &made),
            },
            result: match (yes.result, no.result) {
                (Some(yes), Some(no)) => Some(Value::choose(truth, &yes, &no, &made)),
                (yes, no) => yes.or(no),
            },
            returned: both(yes.returned, no.returned),
            callers: yes.callers,
            broken: both(yes.broken, no.broken),
            continued: both(yes.continued, no.continued),
            made: made.clone(),
        }
    }
}
