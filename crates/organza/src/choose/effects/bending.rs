//! `bending.NAME`: reflection and refraction at the surfaces of an object. Without it the object is drawn as if what it bounds had no index.
//!
//! A bent ray shows other things than a straight one, all of them between black and L, the most radiance that anything shows: the pixel changes by g·L
//! at most. Rays are bent from where the view meets what bends them: where no such object is in view, nothing is.

use super::gain::bound;
use super::{Open, Row, leave_out, object_candidates};
use crate::plan::{Bound, Plan};
use crate::scene::EffectKind;
use crate::statistics::Statistics;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Bending,
    what: "reflection and refraction at surfaces that bound matter",
    without: "light goes straight through it",
    candidates,
    take: |plan, candidates, is_on| leave_out(EffectKind::Bending, plan, candidates, is_on),
    work: Some(|work, _| work.bending()),
};

fn candidates(statistics: &Statistics, _: &Plan) -> Vec<super::Candidate> {
    object_candidates(&ROW, statistics, "no surface that bends light is drawn by a technique that can", |_| Open {
        bound: of_rays(EffectKind::Bending, statistics),
        on: "its surfaces bound matter with an index".to_owned(),
        off: "no view ray meets what bends light".to_owned(),
    })
}

/// The bound of where rays of an effect go.
pub(super) fn of_rays(kind: EffectKind, statistics: &Statistics) -> Bound {
    // A bent ray may meet what lies out of view.
    let meets = |object: &&crate::statistics::ObjectFacts| {
        object.is_in_view && (object.causes.contains(&EffectKind::Bending) || object.causes.contains(&kind))
    };
    if statistics.objects.iter().any(|object| meets(&object)) {
        bound(statistics.brightest, statistics)
    } else {
        Bound::Nothing
    }
}
