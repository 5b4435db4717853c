#include "engine/scene/detail/reader.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::scene_detail {

namespace {

constexpr Real kUnitTolerance = 1e-3;  // how far a quaternion's or a normal's length may be from 1

std::string listed(const std::vector<std::string_view>& words) {
    std::string text;
    for (const std::string_view word : words) text.append(text.empty() ? "" : ", ").append(word);
    return text;
}

std::string rule_text(Range range) {
    switch (range) {
        case Range::kPositive:
            return "> 0";
        case Range::kNotNegative:
            return ">= 0";
        case Range::kAny:
            break;
    }
    return "finite";
}

bool within(Real x, Range range) {
    switch (range) {
        case Range::kPositive:
            return x > 0;
        case Range::kNotNegative:
            return x >= 0;
        case Range::kAny:
            break;
    }
    return true;
}

// Reads a list of exactly n numbers.
bool read_numbers(const Json& value, std::size_t n, Range range, Mistakes& mistakes, Real* out) {
    if (!value.is_array() || value.size() != n) {
        mistakes.add(quoted(value) + ", must be a list of " + std::to_string(n) + " numbers");
        return false;
    }
    bool right = true;
    for (std::size_t i = 0; i < n; ++i) {
        Mistakes::Scope at(mistakes, i);
        right = read_number(value[i], range, mistakes, out[i]) && right;
    }
    return right;
}

}  // namespace

std::string quoted(const Json& value) {
    constexpr std::size_t kLongest = 40;
    if (value.is_array()) {
        const bool short_and_flat =
            value.size() <= 4 && std::all_of(value.begin(), value.end(), [](const Json& v) { return v.is_number(); });
        if (!short_and_flat) return "a list of " + std::to_string(value.size());
    }
    if (value.is_object()) return "an object";
    if (value.is_string() && value.get_ref<const std::string&>().size() > kLongest)
        return "a text of " + std::to_string(value.size()) + " bytes";
    return value.dump();
}

bool read_number(const Json& value, Range range, Mistakes& mistakes, Real& out) {
    if (!value.is_number()) {
        mistakes.add(quoted(value) + ", must be a number");
        return false;
    }
    const Real x = value.get<Real>();
    if (!std::isfinite(x) || !within(x, range)) {
        mistakes.add(quoted(value) + ", must be " + rule_text(std::isfinite(x) ? range : Range::kAny));
        return false;
    }
    out = x;
    return true;
}

bool read_vec3(const Json& value, Range range, Mistakes& mistakes, Vec3& out) {
    Real x[3] = {0, 0, 0};
    if (!read_numbers(value, 3, range, mistakes, x)) return false;
    out = Vec3(x[0], x[1], x[2]);
    return true;
}

ObjectReader::ObjectReader(const Json& value, Mistakes& mistakes) : mistakes_(mistakes) {
    if (value.is_object()) {
        object_ = &value;
    } else {
        mistakes_.add(quoted(value) + ", must be an object");
    }
}

bool ObjectReader::has(std::string_view key) const {
    return object_ != nullptr && object_->contains(key);
}

const Json* ObjectReader::value(std::string_view key, Need need, const char* rule) {
    if (object_ == nullptr) return nullptr;
    known_.push_back(key);
    const Json::const_iterator found = object_->find(key);
    if (found != object_->end()) return &*found;
    if (need == Need::kRequired) {
        Mistakes::Scope in(mistakes_, key);
        mistakes_.add(std::string("missing, must be ") + rule);
    }
    return nullptr;
}

bool ObjectReader::number(std::string_view key, Real& out, Range range, Need need) {
    const std::string rule = range == Range::kAny ? "a number" : "a number " + rule_text(range);
    const Json* given = value(key, need, rule.c_str());
    if (given == nullptr) return false;
    Mistakes::Scope in(mistakes_, key);
    return read_number(*given, range, mistakes_, out);
}

bool ObjectReader::vec3(std::string_view key, Vec3& out, Need need, Range range) {
    const Json* given = value(key, need, "a list of 3 numbers");
    if (given == nullptr) return false;
    Mistakes::Scope in(mistakes_, key);
    return read_vec3(*given, range, mistakes_, out);
}

bool ObjectReader::axis(std::string_view key, Vec3& out, Need need) {
    Vec3 v;
    if (!vec3(key, v, need)) return false;
    // stableNormalized: the square of a very short or long vector leaves the range of a double, the direction does not.
    const Vec3 direction = v.stableNormalized();
    if (std::abs(direction.norm() - 1) > kUnitTolerance) {
        Mistakes::Scope in(mistakes_, key);
        mistakes_.add(quoted(object_->at(std::string(key))) + ", must not be zero");
        return false;
    }
    out = direction;
    return true;
}

bool ObjectReader::unit_vec3(std::string_view key, Vec3& out, Need need) {
    Vec3 v;
    if (!vec3(key, v, need)) return false;
    if (std::abs(v.norm() - 1) > kUnitTolerance) {
        Mistakes::Scope in(mistakes_, key);
        mistakes_.add(quoted(object_->at(std::string(key))) + ", must be a unit vector (length 1 within 0.001)");
        return false;
    }
    out = v.normalized();
    return true;
}

bool ObjectReader::rotation(std::string_view key, Quat& out, Need need) {
    const Json* given = value(key, need, "a unit quaternion [w, x, y, z]");
    if (given == nullptr) return false;
    Mistakes::Scope in(mistakes_, key);
    Real q[4] = {1, 0, 0, 0};
    if (!read_numbers(*given, 4, Range::kAny, mistakes_, q)) return false;
    const Quat wxyz(q[0], q[1], q[2], q[3]);
    if (std::abs(wxyz.norm() - 1) > kUnitTolerance) {
        mistakes_.add(quoted(*given) + ", must be a unit quaternion [w, x, y, z] (length 1 within 0.001)");
        return false;
    }
    out = wxyz.normalized();
    return true;
}

bool ObjectReader::text(std::string_view key, std::string& out, Need need) {
    const Json* given = value(key, need, "a text");
    if (given == nullptr) return false;
    if (!given->is_string()) {
        Mistakes::Scope in(mistakes_, key);
        mistakes_.add(quoted(*given) + ", must be a text");
        return false;
    }
    out = given->get<std::string>();
    return true;
}

bool ObjectReader::flag(std::string_view key, bool& out, Need need) {
    const Json* given = value(key, need, "true or false");
    if (given == nullptr) return false;
    if (!given->is_boolean()) {
        Mistakes::Scope in(mistakes_, key);
        mistakes_.add(quoted(*given) + ", must be true or false");
        return false;
    }
    out = given->get<bool>();
    return true;
}

bool ObjectReader::word(std::string_view key, const std::vector<std::string_view>& words, std::size_t& out, Need need) {
    const std::string rule = "one of " + listed(words);
    const Json* given = value(key, need, rule.c_str());
    if (given == nullptr) return false;
    const auto found = given->is_string() ? std::find(words.begin(), words.end(), given->get_ref<const std::string&>()) : words.end();
    if (found == words.end()) {
        Mistakes::Scope in(mistakes_, key);
        mistakes_.add(quoted(*given) + ", must be " + rule);
        return false;
    }
    out = static_cast<std::size_t>(found - words.begin());
    return true;
}

const Json* ObjectReader::list(std::string_view key, Need need, const char* of) {
    const std::string rule = std::string("a list of ") + of;
    const Json* given = value(key, need, rule.c_str());
    if (given == nullptr || given->is_array()) return given;
    Mistakes::Scope in(mistakes_, key);
    mistakes_.add(quoted(*given) + ", must be " + rule);
    return nullptr;
}

void ObjectReader::refuse(std::string_view key, const std::string& why) {
    known_.push_back(key);
    if (!has(key)) return;
    Mistakes::Scope in(mistakes_, key);
    mistakes_.add("must not be given: " + why);
}

void ObjectReader::finish() {
    if (object_ == nullptr) return;
    for (const auto& [key, unused] : object_->items()) {
        if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
        const std::string_view near = nearest_word(key, known_);
        const std::string hint = near.empty() ? "known are " + listed(known_) : "did you mean \"" + std::string(near) + "\"?";
        Mistakes::Scope in(mistakes_, std::string_view(key));
        mistakes_.add("unknown key, " + hint);
    }
}

}  // namespace cairn::scene_detail
