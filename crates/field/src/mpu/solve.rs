//! Small symmetric systems of equations.

/// A pivot that falls below this part of its diagonal entry means that the data leave a direction open.
const OPEN_DIRECTION: f64 = 1e-10;

/// Solves A·x = b for a positive definite A, given by its lower triangle, by Cholesky's method; `None` where rounding
/// could decide the result. Scaling A scales nothing else: the test is relative.
pub(super) fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> Option<[f64; N]> {
    for i in 0..N {
        let diagonal = a[i][i];
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
            let rest = a[i][j] - known;
            if i > j {
                a[i][j] = rest / a[j][j];
            } else if rest > OPEN_DIRECTION * diagonal {
                a[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    for i in 0..N {
        let known: f64 = (0..i).map(|k| a[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|k| a[k][i] * b[k]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    Some(b)
}

/// Adds weight·φφᵀ to the lower triangle of A and weight·value·φ to b.
pub(super) fn add_equation<const N: usize>(
    a: &mut [[f64; N]; N],
    b: &mut [f64; N],
    phi: &[f64; N],
    value: f64,
    weight: f64,
) {
    for i in 0..N {
        let scaled = weight * phi[i];
        b[i] += scaled * value;
        for j in 0..=i {
            a[i][j] += scaled * phi[j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_system_is_solved_and_an_open_one_refused() {
        let mut a = [[0.0; 3]; 3];
        let mut b = [0.0; 3];
        for (phi, value) in [([1.0, 2.0, 0.5], 6.5), ([0.0, 1.0, 3.0], 11.0), ([2.0, -1.0, 1.0], 3.0)] {
            add_equation(&mut a, &mut b, &phi, value, 0.25);
        }
        let x = solve(a, b).expect("three independent equations");
        assert!(x.iter().zip([1.0, 2.0, 3.0]).all(|(x, e)| (x - e).abs() < 1e-12), "{x:?}");
        let mut a = [[0.0; 3]; 3];
        let mut b = [0.0; 3];
        add_equation(&mut a, &mut b, &[1.0, 2.0, 0.5], 6.5, 1.0);
        add_equation(&mut a, &mut b, &[2.0, 4.0, 1.0], 13.0, 1.0);
        assert_eq!(solve(a, b), None);
        assert_eq!(solve([[0.0; 2]; 2], [0.0; 2]), None);
    }
}
