#include "engine/base/error.hpp"

#include "tests/support/catch.hpp"

#include <functional>
#include <string>

using namespace cairn;

namespace {

std::string text_of(const std::function<void()>& thrower) {
    try {
        thrower();
    } catch (const Error& e) {
        return e.what();
    }
    return "nothing thrown";
}

}  // namespace

TEST_CASE("an invalid value is told with its name, itself and the rule") {
    CHECK(text_of([] { throw_invalid("radius", -1, "> 0"); }) == "radius: -1, must be > 0");
    CHECK(text_of([] { throw_invalid("mass", 0.1, "finite"); }) == "mass: 0.1, must be finite");
    CHECK(text_of([] { throw_invalid("mass", -1.0 / 0.0, "finite"); }) == "mass: -inf, must be finite");
    CHECK(text_of([] { throw_invalid("type", "ghost", "box or sphere"); }) == "type: ghost, must be box or sphere");
}

TEST_CASE("an Error is a runtime error, so a caller that knows only the standard catches it") {
    CHECK_THROWS_AS(throw_invalid("a", 1, "2"), std::runtime_error);
}
