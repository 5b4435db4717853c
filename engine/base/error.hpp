// The one exception type of Cairn: thrown at the boundary (adding bodies, shapes and joints; reading files), never by World::step.
// The message names the object, the value and what would be valid. Nothing has been changed when it is thrown.
#pragma once

#include <stdexcept>
#include <string>

namespace cairn {

class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// "WHAT: VALUE, must be RULE", e.g. throw_invalid("radius", -1, "> 0") → Error("radius: -1, must be > 0").
[[noreturn]] void throw_invalid(const std::string& what, double value, const std::string& rule);
[[noreturn]] void throw_invalid(const std::string& what, const std::string& value, const std::string& rule);

}  // namespace cairn
