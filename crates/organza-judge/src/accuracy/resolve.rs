//! The error of a reference, and the errors that it can resolve.
//!
//! A knob's error against its end, E(h), is the true error less what the end leaves: e(h) = C·h^p, E(h) = C·(h^p − h_end^p)
//! (Richardson). So own = e(h_end) = E(h)/((h/h_end)^p − 1) from the finest step, and p is fitted to E + own; the two are
//! iterated. To be careful, p is the least of the fit and of the slope between the two finest steps. Plots leave out errors
//! below ten times the reference's error.

use super::Step;
use reference::statistics::{Fit, fit_order};

/// How many times larger than the reference's own error an error must be to be drawn.
pub(super) const MARGIN: f64 = 10.0;

/// Steps whose error is more than this share of the next coarser one's do not take part in a fit, from the coarsest on.
const SATURATED: f64 = 0.9;

/// Slopes below this say that a knob does not converge yet.
const LEAST_ORDER: f64 = 0.25;

/// A point of a convergence curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Index of the setting.
    pub setting: usize,
    /// Size of the step; `None` for a choice.
    pub size: Option<f64>,
    /// RMSE of linear radiance against the knob's end; `None` if it was not measured.
    pub error: Option<f64>,
    /// Whether the error is large enough to be drawn.
    pub drawn: bool,
}

/// The convergence of a picture as one knob is turned.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The knob's name.
    pub knob: &'static str,
    /// The end that the others are judged by.
    pub end: Step,
    /// Size of the end; `None` where it is exact.
    pub end_size: Option<f64>,
    /// Points from coarse to fine.
    pub points: Vec<CurvePoint>,
    /// RMSE of the scene's stated setting against the end.
    pub own_setting: f64,
    /// The error of the end, and the order of convergence.
    pub settled: Settled,
    /// Seconds that drawing the end took, once; `None` if the end is one of the settings.
    pub end_seconds: Option<f64>,
}

/// The worth of a knob's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// RMSE that the end itself is away from the true limit, estimated.
    pub own_error: f64,
    /// Power law fitted to the errors that can be drawn; [`Settled::order`] decides whether its slope is an order.
    pub fit: Option<Fit>,
    /// The careful order that `own_error` was computed with; `None` where the end is exact.
    pub careful_order: Option<f64>,
}

impl Settled {
    /// The least error that may be drawn.
    pub fn least_drawn(&self) -> f64 {
        MARGIN * self.own_error
    }

    /// The fit, if its slope is an order of convergence: the 95 % interval has to be narrower than the slope itself. Two points
    /// have no interval, because any line fits them, so their slope is no order.
    pub fn order(&self) -> Option<Fit> {
        self.fit.filter(|fit| fit.half_width.is_some_and(|half_width| 2.0 * half_width < fit.order.abs()))
    }
}

/// Judges the end of a knob by errors against it. `points` are (size, error) from coarse to fine. `end` is the size of the
/// end, `None` if the end is exact. `floor` is the error of rounding alone.
pub fn settle(points: &[[f64; 2]], end: Option<f64>, floor: f64) -> Settled {
    let mut points: Vec<[f64; 2]> = points.iter().copied().filter(|p| p[1].is_finite()).collect();
    points.sort_by(|a, b| b[0].total_cmp(&a[0]));
    let (own_error, careful_order) = match end {
        None => (floor, None),
        Some(end) => richardson(&points, end, floor),
    };
    let corrected = if end.is_some() { own_error } else { 0.0 };
    let drawn = points.iter().filter(|p| p[1] >= MARGIN * own_error).map(|p| [p[0], p[1] + corrected]);
    let drawn: Vec<[f64; 2]> = drawn.collect();
    // As long as a finer step changes nothing, the knob is so coarse that its error cannot grow any more.
    let saturated = drawn.windows(2).take_while(|w| w[1][1] > SATURATED * w[0][1]).count();
    Settled { own_error, fit: fit_order(&drawn[saturated..]), careful_order }
}

/// Own error of the end, and the order that it follows from.
fn richardson(points: &[[f64; 2]], end: f64, floor: f64) -> (f64, Option<f64>) {
    let above: Vec<[f64; 2]> = points.iter().copied().filter(|p| p[0] > end && p[1] > floor).collect();
    let Some(finest) = above.last() else {
        // Nothing differs by more than rounding: so does the end.
        return (points.last().map_or(f64::INFINITY, |_| floor), None);
    };
    let mut end_error = 0.0;
    let mut order = 0.0;
    for _ in 0..30 {
        let corrected: Vec<[f64; 2]> = above.iter().map(|p| [p[0], p[1] + end_error]).collect();
        let fitted = fit_order(&corrected).map_or(0.0, |f| f.order);
        let last = fit_order(&corrected[corrected.len().saturating_sub(2)..]).map_or(0.0, |f| f.order);
        order = fitted.min(last);
        if order < LEAST_ORDER {
            // No convergence to build on: the end may be as wrong as the step before it.
            return (finest[1], Some(order));
        }
        end_error = finest[1] / ((finest[0] / end).powf(order) - 1.0);
    }
    (end_error.max(floor), Some(order))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(order: f64, end: f64) -> Vec<[f64; 2]> {
        [8.0, 4.0, 2.0, 1.0].iter().map(|h: &f64| [*h, 0.01 * (h.powf(order) - end.powf(order))]).collect()
    }

    #[test]
    fn a_power_law_gives_its_order_and_the_ends_own_error() {
        for order in [0.5, 1.0, 2.0] {
            let end: f64 = 0.125;
            let settled = settle(&law(order, end), Some(end), 0.0);
            let end_error = 0.01 * end.powf(order);
            assert!((settled.own_error / end_error - 1.0).abs() < 0.05, "{order}: {settled:?} {end_error}");
            assert!((settled.careful_order.unwrap() - order).abs() < 0.02, "{order}: {settled:?}");
        }
        // The finest of order 2 are drawn, of order 1/2 only the coarse ones would be ten times above.
        assert!(settle(&law(2.0, 0.125), Some(0.125), 0.0).fit.unwrap().points == 4);
        assert!(settle(&law(0.5, 0.125), Some(0.125), 0.0).fit.is_none());
    }

    #[test]
    fn a_slope_whose_interval_is_wider_than_itself_is_no_order() {
        let order = |points: &[[f64; 2]]| settle(points, None, 0.0).order().map(|fit| fit.order);
        let exact = [[4.0, 4e-3], [2.0, 2e-3], [1.0, 1e-3]];
        assert!((order(&exact).unwrap() - 1.0).abs() < 1e-9);
        // Slopes of 3 and of 0.2: a mean of 1.6, and t(1) = 12.7 times its standard error of 0.8.
        let bent = [[4.0, 8.0 * 1.149e-3], [2.0, 1.149e-3], [1.0, 1e-3]];
        assert_eq!(order(&bent), None);
        assert!(settle(&bent, None, 0.0).fit.unwrap().half_width.unwrap() > 10.0);
        assert_eq!(order(&exact[..2]), None, "any line fits two points");
    }

    #[test]
    fn errors_that_do_not_fall_make_the_end_worthless() {
        let flat = [[8.0, 0.01], [4.0, 0.011], [2.0, 0.0099], [1.0, 0.0101]];
        let settled = settle(&flat, Some(0.5), 0.0);
        assert_eq!((settled.own_error, settled.fit), (0.0101, None));
    }

    #[test]
    fn an_exact_end_is_worth_the_rounding() {
        let points = [[4.0, 4e-3], [2.0, 1e-3], [1.0, 2.5e-4], [0.5, 1e-9]];
        let settled = settle(&points, None, 1e-8);
        assert_eq!(settled.own_error, 1e-8);
        let fit = settled.fit.unwrap();
        assert!(fit.points == 3 && (fit.order - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_knob_without_effect_has_no_order() {
        let settled = settle(&[[2.0, 0.0], [1.0, 0.0]], Some(0.5), 1e-8);
        assert_eq!((settled.own_error, settled.fit, settled.careful_order), (1e-8, None, None));
        assert_eq!(settle(&[], Some(0.5), 1e-8).own_error, f64::INFINITY);
    }
}
