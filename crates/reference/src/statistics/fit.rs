//! Convergence order: the slope of log error over log size.
//!
//! error = C·size^p; p by least squares in logarithms, its interval from the residuals and Student's t with n − 2 degrees
//! of freedom.

use super::student_t_95;

/// A fitted power law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The order p.
    pub order: f64,
    /// ln C.
    pub log_factor: f64,
    /// Half of the 95 % confidence interval of p; `None` for two points, which any line fits.
    pub half_width: Option<f64>,
    /// Points that took part.
    pub points: usize,
}

/// Fits error = C·size^p; `None` for fewer than two different sizes. Points whose size or error is not above 0 and finite
/// do not take part.
pub fn fit_order(points: &[[f64; 2]]) -> Option<Fit> {
    let usable = |v: &f64| *v > 0.0 && v.is_finite();
    let logs: Vec<[f64; 2]> = points.iter().filter(|p| p.iter().all(usable)).map(|p| [p[0].ln(), p[1].ln()]).collect();
    let n = logs.len() as f64;
    let mean = |c: usize| logs.iter().map(|p| p[c]).sum::<f64>() / n;
    let mx = mean(0);
    let my = mean(1);
    let sxx: f64 = logs.iter().map(|p| (p[0] - mx).powi(2)).sum();
    if logs.len() < 2 || sxx < 1e-12 {
        return None;
    }
    let order = logs.iter().map(|p| (p[0] - mx) * (p[1] - my)).sum::<f64>() / sxx;
    let log_factor = my - order * mx;
    let residual: f64 = logs.iter().map(|p| (p[1] - log_factor - order * p[0]).powi(2)).sum();
    let half_width = (logs.len() > 2).then(|| student_t_95(logs.len() - 2) * (residual / (n - 2.0) / sxx).sqrt());
    Some(Fit { order, log_factor, half_width, points: logs.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_exactly() {
        let points: Vec<[f64; 2]> = [1.0, 0.5, 0.25, 0.125].iter().map(|h: &f64| [*h, 3.0 * h.powf(1.5)]).collect();
        let fit = fit_order(&points).unwrap();
        assert!((fit.order - 1.5).abs() < 1e-12 && (fit.log_factor - 3f64.ln()).abs() < 1e-12);
        assert!(fit.half_width.unwrap() < 1e-10 && fit.points == 4);
    }

    #[test]
    fn the_interval_by_hand() {
        // x = −1, 0, 1 and y = 0, 1, 1 in logarithms: slope 1/2, residuals −1/6, 1/3, −1/6, t(1) = 12.706.
        let points = [[-1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|p: [f64; 2]| p.map(f64::exp));
        let fit = fit_order(&points).unwrap();
        assert!((fit.order - 0.5).abs() < 1e-12);
        assert!((fit.half_width.unwrap() - 12.7062 * (1.0f64 / 12.0).sqrt()).abs() < 1e-3);
    }

    #[test]
    fn what_cannot_be_fitted() {
        assert_eq!(fit_order(&[[1.0, 1.0]]), None);
        assert_eq!(fit_order(&[[1.0, 1.0], [1.0, 2.0]]), None);
        assert_eq!(fit_order(&[[1.0, 1.0], [0.5, 0.0], [0.25, f64::NAN]]), None);
        assert_eq!(fit_order(&[[1.0, 1.0], [2.0, 4.0]]).unwrap().half_width, None);
    }
}
