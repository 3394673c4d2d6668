//! The changes of a view, step by step, so that each can be taken back.

use super::State;
use crate::event::Event;
use crate::viewpoint::Viewpoint;
use organza::Error;
use organza::scene::Scene;
use std::collections::VecDeque;

/// Most steps that can be taken back.
const MOST_STEPS: usize = 200;

/// The states of a view: the present one, those before it, and those that were taken back. The viewpoint belongs to none of them: it stays where it is.
#[derive(Debug, Clone, Default)]
pub(crate) struct History {
    present: State,
    /// From the oldest.
    past: VecDeque<State>,
    /// From the one that was taken back first.
    future: Vec<State>,
    /// What the last event changed; `None` where the next event begins a step in any case.
    subject: Option<String>,
}

impl History {
    pub(crate) const fn present(&self) -> &State {
        &self.present
    }

    /// Whether there is a step to take back.
    pub(crate) fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is a step that was taken back.
    pub(crate) const fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// Takes an event in. Consecutive events with one subject are one step, unless [`Event::Done`] stands between them.
    ///
    /// # Errors
    /// As [`State::apply`]; nothing is changed then.
    pub(crate) fn apply(&mut self, event: &Event, scene: &Scene, first: &Viewpoint) -> Result<(), Error> {
        match event {
            Event::Done {} => self.subject = None,
            Event::Undo {} => {
                if let Some(before) = self.past.pop_back() {
                    self.future.push(self.present.clone());
                    self.present.become_like(before);
                }
                self.subject = None;
            }
            Event::Redo {} => {
                if let Some(after) = self.future.pop() {
                    self.past.push_back(self.present.clone());
                    self.present.become_like(after);
                }
                self.subject = None;
            }
            _ => {
                let mut state = self.present.clone();
                state.apply(event, scene, first)?;
                let before = std::mem::replace(&mut self.present, state);
                if event.is_of_viewpoint() || before == self.present {
                    return Ok(());
                }
                let subject = Some(event.subject());
                if self.subject != subject {
                    self.past.push_back(before);
                    if self.past.len() > MOST_STEPS {
                        self.past.pop_front();
                    }
                    self.subject = subject;
                }
                self.future.clear();
            }
        }
        Ok(())
    }

    /// The same steps in a scene that was edited.
    pub(crate) fn of_another_scene(&self, before: &Scene, after: &Scene) -> Self {
        let moved = |state: &State| state.of_another_scene(before, after);
        Self {
            present: moved(&self.present),
            past: self.past.iter().map(moved).collect(),
            future: self.future.iter().map(moved).collect(),
            subject: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::Opening;
    use organza::RenderOptions;

    const SCENE: &[u8] = b"version = 1\n[camera]\nsize = [8, 8]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\n\
                           [[object]]\nname = \"a\"\nmesh = \"a.ply\"\n[[object]]\nname = \"b\"\nmesh = \"b.ply\"\n";

    fn opacity(object: &str, opacity: f64) -> Event {
        Event::Opacity { object: object.into(), opacity: Some(opacity) }
    }

    #[test]
    fn a_drag_is_one_step_and_the_view_stays() {
        let opening = Opening::of_text("scene.toml", SCENE, RenderOptions::default());
        let scene = organza::scene::parse(&opening.file, &opening.text, &opening.load).unwrap();
        let first = Viewpoint::of_scene(&scene);
        let mut history = History::default();
        let mut states = vec![State::default()];
        let take = |history: &mut History, event: &Event| history.apply(event, &scene, &first).unwrap();
        // Three steps: two drags of one slider, the first with the view turned meanwhile, and one of another.
        for events in [
            &[opacity("a", 0.9), Event::Zoom { steps: 1.0 }, opacity("a", 0.5)][..],
            &[Event::Done {}, opacity("a", 0.2), opacity("a", 0.2)],
            &[opacity("b", 0.5)],
        ] {
            events.iter().for_each(|event| take(&mut history, event));
            states.push(history.present().clone());
        }
        let end = states[3].clone();
        let viewpoint = end.viewpoint().copied();
        assert!(viewpoint.is_some() && !history.can_redo());
        for state in states[..3].iter().rev() {
            assert!(history.can_undo());
            take(&mut history, &Event::Undo {});
            assert_eq!(history.present(), &state.clone().seen_from(viewpoint));
        }
        assert!(!history.can_undo());
        take(&mut history, &Event::Undo {});
        (0..3).for_each(|_| take(&mut history, &Event::Redo {}));
        assert!(history.present() == &end && !history.can_redo());
        // All changes at once are a step, too; a change ends what was taken back.
        take(&mut history, &Event::Restore {});
        assert_eq!(history.present(), &State::default().seen_from(viewpoint));
        take(&mut history, &Event::Undo {});
        assert_eq!(history.present(), &end);
        take(&mut history, &opacity("b", 0.1));
        assert!(!history.can_redo());
        // An event that is refused changes nothing, and makes no step.
        let steps = history.past.len();
        assert!(history.apply(&opacity("c", 0.1), &scene, &first).is_err());
        assert_eq!(history.past.len(), steps);
    }

    #[test]
    fn steps_have_an_end() {
        let opening = Opening::of_text("scene.toml", SCENE, RenderOptions::default());
        let scene = organza::scene::parse(&opening.file, &opening.text, &opening.load).unwrap();
        let first = Viewpoint::of_scene(&scene);
        let mut history = History::default();
        for step in 0..2 * MOST_STEPS {
            let visible = step % 2 == 1;
            history.apply(&Event::Show { object: "a".into(), visible }, &scene, &first).unwrap();
            history.apply(&Event::Done {}, &scene, &first).unwrap();
        }
        assert_eq!(history.past.len(), MOST_STEPS);
    }
}
