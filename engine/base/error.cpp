#include "engine/base/error.hpp"

#include <cstdio>

namespace cairn {

void throw_invalid(const std::string& what, double value, const std::string& rule) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", value);
    throw_invalid(what, std::string(text), rule);
}

void throw_invalid(const std::string& what, const std::string& value, const std::string& rule) {
    throw Error(what + ": " + value + ", must be " + rule);
}

}  // namespace cairn
