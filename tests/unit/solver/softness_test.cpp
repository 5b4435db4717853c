#include "solver/softness.hpp"

#include "tests/support/catch.hpp"

using namespace cairn;

// One step of m ẍ = −m ω² x − 2 ζ m ω ẋ by implicit Euler, from x and v: v' = (v − h ω² x) / (1 + 2 ζ h ω + h² ω²).
TEST_CASE("a soft row moves a body as a damped spring integrated implicitly, and more sweeps change nothing") {
    const Real h_omega = GENERATE(1e-3, 0.1, 1.0, 1.5707963267948966, 10.0, 1e3);
    const Real damping = GENERATE(0.0, 0.5, 1.0, 5.0);
    CAPTURE(h_omega, damping);
    const Real h = 0.01, mass = 3, x = 0.02, v = -0.7;
    const Softness soft = make_softness(h_omega, damping);
    Real velocity = v, impulse = 0;
    for (int sweep = 0; sweep < 3; ++sweep) {
        const Real delta = -soft.mass_scale * mass * (velocity + soft.rate * x / h) - soft.impulse_scale * impulse;
        impulse += delta;
        velocity += delta / mass;
        const Real expected = (v - h_omega * h_omega * x / h) / (1 + 2 * damping * h_omega + h_omega * h_omega);
        CAPTURE(sweep);
        CHECK(std::abs(velocity - expected) < 1e-14);  // a dozen roundings of 2 m/s
    }
}

TEST_CASE("a soft row is rigid for an infinite frequency and absent for none") {
    const Softness rigid = make_softness(1e20, 1), absent = make_softness(0, 1), plain;
    CHECK(rigid.rate == Approx(plain.rate).epsilon(1e-15));
    CHECK(rigid.mass_scale == Approx(plain.mass_scale).epsilon(1e-15));
    CHECK(std::abs(rigid.impulse_scale - plain.impulse_scale) < 1e-15);
    CHECK(absent.rate == 0);
    CHECK(absent.mass_scale == 0);
    CHECK(absent.impulse_scale == 1);
}

TEST_CASE("a stiffer row takes more of its error back, a more damped one less; its two scales add up to one") {
    Real rate = 0;
    for (Real h_omega = 0.01; h_omega < 1000; h_omega *= 1.5) {
        const Softness soft = make_softness(h_omega, 0.5);
        CHECK(soft.rate > rate);
        CHECK(soft.rate < 1);
        CHECK(std::abs(soft.mass_scale + soft.impulse_scale - 1) < 4e-16);
        CHECK(make_softness(h_omega, 1).rate < soft.rate);
        rate = soft.rate;
    }
}
