//! Data in parts: what several holders answer together is what one who has all answers.

mod support;

use std::sync::{Condvar, Mutex};

use kilauea_spot::{Answerer, Engine, Parts, Route, RunError, Split, WireError};
use support::hall::{Answer, Geometry, Hall, Node, Question, mix};
use support::outputs::Outputs;

const HALL: Hall = Hall {
    depth: 10,
    fan_out: 2,
    n_terms: 0,
};
const N_ROOTS: usize = 200;

/// Each answer is known to one holder; the others have nothing.
struct Holders {
    n: usize,
    /// Whether all are asked, or who knows and one more.
    asks_all: bool,
    /// Who does what instead of answering.
    fault: Option<(usize, Fault)>,
}

#[derive(Clone, Copy)]
enum Fault {
    Panics,
    PanicsAsAsked,
    Fails,
}

const NOTHING: Answer = Answer {
    t: f32::INFINITY,
    weights: [0.0; 2],
    id: 0,
};

impl Holders {
    fn who_knows(&self, question: &Question) -> usize {
        (mix(question.key ^ 0x77) % self.n as u64) as usize
    }

    /// Questions whose answer everyone has.
    fn is_known_to_all(question: &Question) -> bool {
        mix(question.key ^ 0x99).is_multiple_of(16)
    }
}

impl Parts<Hall> for Holders {
    fn n_parts(&self) -> usize {
        self.n
    }

    fn route(&self, question: Question) -> Route<Hall> {
        if matches!(self.fault, Some((_, Fault::PanicsAsAsked))) {
            panic!("nobody knows whom to ask");
        }
        if Self::is_known_to_all(&question) {
            return Route::Answered(Answerer::<Hall>::answer(&Geometry, question));
        }
        let all = (1 << self.n) - 1;
        let other = mix(question.key ^ 0x55) % self.n as u64;
        let whom = if self.asks_all {
            all
        } else {
            1 << self.who_knows(&question) | 1 << other
        };
        // Who asks may know something that is no more than what the others know.
        let known = mix(question.key ^ 0x33).is_multiple_of(3);
        Route::Asked {
            question,
            whom,
            known: known.then_some(NOTHING),
        }
    }

    fn n_kinds(&self) -> usize {
        2
    }

    fn kind(&self, question: &Question) -> usize {
        (question.key % 2) as usize
    }

    fn combine(&self, one: Answer, other: Answer) -> Answer {
        if one.t < other.t { one } else { other }
    }

    fn answer(&self, part: usize, questions: Vec<Question>) -> Result<Vec<Answer>, RunError> {
        match self.fault {
            Some((faulty, Fault::Panics)) if faulty == part => panic!("holder {part} is ill"),
            Some((faulty, Fault::Fails)) if faulty == part => {
                return Err(RunError::Malformed {
                    n_bytes: 3,
                    source: WireError::Short,
                });
            }
            _ => {}
        }
        let kinds = questions.iter().map(|q| q.key % 2);
        assert!(kinds.clone().all(|kind| Some(kind) == kinds.clone().next()));
        let answers = questions.into_iter().map(|question| {
            if self.who_knows(&question) == part {
                Answerer::<Hall>::answer(&Geometry, question)
            } else {
                NOTHING
            }
        });
        Ok(answers.collect())
    }
}

#[test]
fn several_holders_answer_as_one_does() {
    let job = Outputs::new(N_ROOTS, Node::Entrance);
    let whole = Engine::new(1).run_inline(&HALL, &Geometry, &job);
    whole.expect("nothing fails");
    let expected = job.into_vec();
    for n in [1, 2, 5] {
        for (asks_all, n_threads) in [(true, 1), (false, 3)] {
            let holders = Holders {
                n,
                asks_all,
                fault: None,
            };
            // Few questions at once, or many.
            for engine in [
                Engine::new(n_threads),
                Engine::new(n_threads).questions_out(7),
            ] {
                let job = Outputs::new(N_ROOTS, Node::Entrance);
                let result = engine.run_queued(&HALL, &Split::new(&holders), 1, &job);
                result.expect("nothing fails");
                assert_eq!(job.into_vec(), expected, "{n} holders");
            }
        }
    }
}

#[test]
fn a_holder_that_cannot_answer_ends_the_run() {
    let run = |fault| {
        let holders = Holders {
            n: 3,
            asks_all: true,
            fault: Some((1, fault)),
        };
        let job = Outputs::new(N_ROOTS, Node::Entrance);
        Engine::new(2).run_queued(&HALL, &Split::new(&holders), 1, &job)
    };
    let error = run(Fault::Panics).unwrap_err().to_string();
    assert!(error.contains("holder 1 is ill"), "{error}");
    let error = run(Fault::PanicsAsAsked).unwrap_err().to_string();
    assert!(error.contains("whom to ask"), "{error}");
    let failed = run(Fault::Fails).unwrap_err();
    assert!(matches!(failed, RunError::Malformed { n_bytes: 3, .. }));
}

/// Two holders, of whom the second answers nothing until the first has answered some batches.
#[derive(Default)]
struct Unequal {
    /// Questions of each batch, by holder, in the order of answers.
    batches: Mutex<[Vec<usize>; 2]>,
    answered: Condvar,
}

impl Unequal {
    const N_FIRST: usize = 5;
}

impl Parts<Hall> for Unequal {
    fn n_parts(&self) -> usize {
        2
    }

    fn route(&self, question: Question) -> Route<Hall> {
        Route::Asked {
            question,
            whom: 1 << (mix(question.key) % 2),
            known: None,
        }
    }

    fn combine(&self, _one: Answer, other: Answer) -> Answer {
        other
    }

    fn answer(&self, part: usize, questions: Vec<Question>) -> Result<Vec<Answer>, RunError> {
        let mut batches = self.batches.lock().expect("nobody panics");
        while part == 1 && batches[0].len() < Self::N_FIRST {
            batches = self.answered.wait(batches).expect("nobody panics");
        }
        batches[part].push(questions.len());
        self.answered.notify_all();
        drop(batches);
        let answers = questions.into_iter();
        Ok(answers
            .map(|q| Answerer::<Hall>::answer(&Geometry, q))
            .collect())
    }
}

/// Of few questions each, batches to a busy holder would be as many as answers of the other led to.
#[test]
fn batches_grow_while_their_holder_is_busy() {
    let holders = Unequal::default();
    let job = Outputs::new(N_ROOTS, Node::Entrance);
    let result = Engine::new(1).run_queued(&HALL, &Split::new(&holders), 1, &job);
    result.expect("nothing fails");
    let [first, second] = holders.batches.into_inner().expect("nobody panics");
    let n_meanwhile: usize = first[1..Unequal::N_FIRST].iter().sum();
    assert!(
        3 * second[1] >= 2 * n_meanwhile,
        "{n_meanwhile} questions to the first while the second was busy, then {} to it",
        second[1]
    );
}
