#include "apps/cli/runner.hpp"
#include "apps/cli/options.hpp"
#include "apps/cli/random.hpp"
#include "engine/base/error.hpp"
#include "tests/support/catch.hpp"

#include <cmath>

using namespace cairn;
using namespace cairn::cli;

TEST_CASE("a time step is a number or a fraction") {
    CHECK(parse_time_step("0.01") == 0.01);
    CHECK(parse_time_step("1/240") == 1.0 / 240);
    CHECK(parse_time_step("2.5e-3") == 2.5e-3);
    CHECK(parse_time_step("1.5/90") == 1.5 / 90);
    for (const char* wrong : {"", "0", "-1", "1/", "/60", "1/0", "0/1", "inf", "nan", "1/60/2", "1 /60", "x"}) {
        CAPTURE(wrong);
        CHECK_THROWS_AS(parse_time_step(wrong), Error);
    }
}

TEST_CASE("a run has round(duration / dt) steps and at least one") {
    CHECK(step_count(1, 1.0 / 60) == 60);
    CHECK(step_count(1, 0.07) == 14);
    CHECK(step_count(0.01, 1) == 1);
    CHECK_THROWS_AS(step_count(1, 1e-12), Error);
}

TEST_CASE("samples are the steps nearest the multiples of the interval, and the last") {
    CHECK(sample_steps(0.25, 0.07, 14) == std::vector<long>{4, 7, 11, 14});
    CHECK(sample_steps(0.5, 0.1, 10) == std::vector<long>{5, 10});
    CHECK(sample_steps(0.4, 0.1, 10) == std::vector<long>{4, 8, 10});
    CHECK(sample_steps(1.0 / 60, 1.0 / 60, 3) == std::vector<long>{1, 2, 3});
    CHECK(sample_steps(1e-9, 0.1, 3) == std::vector<long>{1, 2, 3});
    CHECK(sample_steps(100, 0.1, 3) == std::vector<long>{3});
    // An interval a little over the step: multiples 1 … 5 of 0.13 s are nearest to steps 1, 3, 4, 5, 7 of 0.1 s (6.5 rounds up).
    CHECK(sample_steps(0.13, 0.1, 8) == std::vector<long>{1, 3, 4, 5, 7, 8});
}

TEST_CASE("random numbers are those that the standard fixes for the generator") {
    // [rand.predef]: the 10000th number of a default-seeded mt19937_64 is 9981545732273789042; the mapping takes its upper 53 bits.
    Random random(std::mt19937_64::default_seed);
    for (int k = 1; k < 10000; ++k) random.uniform(0, 1);
    CHECK(random.uniform(0, 1) == static_cast<Real>(9981545732273789042ull >> 11) * std::ldexp(1.0, -53));
    for (int k = 0; k < 100; ++k) {
        CHECK(std::abs(random.rotation().norm() - 1) < 1e-15);
        CHECK(std::abs(random.direction().norm() - 1) < 1e-15);
    }
}
