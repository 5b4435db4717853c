// What a solve adds to the kinetic energy T of an island.
//
// For rows with targets <= 0 and Coulomb friction, a solve that converges takes energy away: T(v + M⁻¹ Gᵀ λ) − T(v) = λᵀ G v + ½ λᵀ S λ is
// what it minimises over the admissible λ, and λ = 0 is one of them (a Gauss-Seidel sweep never raises it). Sweeps that are few start from
// warm impulses instead, and after an impact these may be far too large: they throw bodies apart with energy that nothing gave. (Islands
// where nobody is faster than gravity makes it in four steps are left alone: they have little to gain, and a share taken from supports
// lets them sink.)
#pragma once

#include "solver/body.hpp"

namespace cairn {

struct EnergyGain {
    Real sum = 0;    // [J]
    Real moved = 0;  // [J], the sum of the bodies' shares, each without its sign: what rounding is measured by
    bool is_gain() const { return sum > 1e-12 * moved; }
};

inline EnergyGain operator+(const EnergyGain& a, const EnergyGain& b) {
    return {a.sum + b.sum, a.moved + b.moved};
}

// aᵀ M b of a dynamic body [J]: twice the kinetic energy for a = b.
Real kinetic_product(const BodyMotion& body, const BodyVelocity& a, const BodyVelocity& b);

// Notes in SolverBodies::gain what each body of [begin, end) has gained since its velocity was noted (begin_push).
void measure_gain(SolverBodies& bodies, int begin, int end);

// The sum over the bodies [begin, end) that have been measured.
EnergyGain gain_of(const SolverBodies& bodies, int begin, int end);

// The largest share s of the bodies' changes since they were noted, at most all, with which these and `earlier` [J] together are no gain;
// if there is none, the s with the least.
Real lossless_share(const SolverBodies& bodies, int begin, int end, Real earlier);

// Sets velocities to where that share of their changes takes them.
void keep_share(SolverBodies& bodies, int begin, int end, Real share);

}  // namespace cairn
