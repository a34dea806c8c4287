//! Loops with the widest instructions of the processor, and what they need for moving numbers between rows and columns.
//!
//! The bits are the same on all processors, because nothing is fused or reordered.

use concordem_contact::columns::{Lanes, Scalar};
use pulp::Arch;

/// A function that [`dispatch`] compiles for several processors.
pub trait LanesFnOnce {
    /// Type of the result.
    type Output;

    /// Run the function; `lanes` moves numbers in the vector registers of the processor.
    fn call<T: Lanes>(self, lanes: T) -> Self::Output;
}

/// A function and its lanes.
struct WithLanes<F, T> {
    function: F,
    lanes: T,
}

impl<F: LanesFnOnce, T: Lanes> pulp::NullaryFnOnce for WithLanes<F, T> {
    type Output = F::Output;

    #[inline(always)]
    fn call(self) -> F::Output {
        self.function.call(self.lanes)
    }
}

/// Run a function with the widest instructions of the processor.
#[inline(always)]
pub fn dispatch<F: LanesFnOnce>(function: F) -> F::Output {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(v4) => v4.vectorize(WithLanes { function, lanes: avx::Avx(*v4) }),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(v3) => v3.vectorize(WithLanes { function, lanes: avx::Avx(v3) }),
        other => other.dispatch(WithLanes { function, lanes: Scalar }),
    }
}

#[cfg(target_arch = "x86_64")]
mod avx {
    use std::arch::x86_64::__m256d;

    use concordem_contact::columns::Lanes;
    use pulp::cast;
    use pulp::x86::V3;

    /// [`Lanes`] of the registers with four numbers.
    #[derive(Clone, Copy)]
    pub struct Avx(pub V3);

    impl Lanes for Avx {
        #[inline(always)]
        fn transposed(self, rows: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
            let avx = self.0.avx;
            let [a, b, c, d] = rows;
            let (a, b, c, d): (__m256d, __m256d, __m256d, __m256d) = (cast(a), cast(b), cast(c), cast(d));
            // Numbers 0 and 2, then 1 and 3, of two rows each.
            let even = [avx._mm256_unpacklo_pd(a, b), avx._mm256_unpacklo_pd(c, d)];
            let odd = [avx._mm256_unpackhi_pd(a, b), avx._mm256_unpackhi_pd(c, d)];
            [
                cast(avx._mm256_permute2f128_pd::<0x20>(even[0], even[1])),
                cast(avx._mm256_permute2f128_pd::<0x20>(odd[0], odd[1])),
                cast(avx._mm256_permute2f128_pd::<0x31>(even[0], even[1])),
                cast(avx._mm256_permute2f128_pd::<0x31>(odd[0], odd[1])),
            ]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Transposed([[f64; 4]; 4]);

    impl LanesFnOnce for Transposed {
        type Output = [[f64; 4]; 4];

        fn call<T: Lanes>(self, lanes: T) -> [[f64; 4]; 4] {
            lanes.transposed(self.0)
        }
    }

    /// Number `k` of row `r` goes to row `k`, place `r`, on this processor and without its vector registers.
    #[test]
    fn rows_become_columns() {
        let rows: [[f64; 4]; 4] = std::array::from_fn(|r| std::array::from_fn(|k| (10 * r + k) as f64));
        let columns: [[f64; 4]; 4] = std::array::from_fn(|k| std::array::from_fn(|r| (10 * r + k) as f64));
        assert_eq!(dispatch(Transposed(rows)), columns);
        assert_eq!(Scalar.transposed(rows), columns);
    }
}
