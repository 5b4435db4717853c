// Typed reading of one JSON object: every value is checked, every mistake noted with its place, and reading goes on.
#pragma once

#include "engine/base/math.hpp"
#include "engine/scene/detail/json_document.hpp"
#include "engine/scene/detail/mistakes.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace cairn::scene_detail {

enum class Need { kRequired, kOptional };
enum class Range { kAny, kPositive, kNotNegative };

// A value as a message quotes it: numbers and short text in full, lists and objects by what they are.
std::string quoted(const Json& value);

// Each takes the value at the current place; notes a mistake and returns false, leaving `out` alone, when it is not right.
bool read_number(const Json& value, Range range, Mistakes& mistakes, Real& out);
bool read_vec3(const Json& value, Range range, Mistakes& mistakes, Vec3& out);  // range: of each component

// One object of the file. Each reader of a key marks it as known and returns true if it is there and right; a missing optional key
// changes nothing. finish() then notes every key that nobody asked for.
class ObjectReader {
public:
    // `value` must outlive the reader. If it is no object, that is noted and every key counts as absent, silently.
    ObjectReader(const Json& value, Mistakes& mistakes);

    bool is_object() const { return object_ != nullptr; }
    bool has(std::string_view key) const;

    bool number(std::string_view key, Real& out, Range range, Need need);
    bool vec3(std::string_view key, Vec3& out, Need need, Range range = Range::kAny);
    // A direction: any length but zero; comes back normalised.
    bool axis(std::string_view key, Vec3& out, Need need);
    // A unit vector within 1e-3; comes back normalised.
    bool unit_vec3(std::string_view key, Vec3& out, Need need);
    // [w, x, y, z], a unit quaternion within 1e-3; comes back normalised.
    bool rotation(std::string_view key, Quat& out, Need need);
    bool text(std::string_view key, std::string& out, Need need);
    bool flag(std::string_view key, bool& out, Need need);
    // The index in `words` of a text that must be one of them.
    bool word(std::string_view key, const std::vector<std::string_view>& words, std::size_t& out, Need need);
    // The list itself, or nullptr.
    const Json* list(std::string_view key, Need need, const char* of);
    // The value as it is, or nullptr; `rule` says what it must be when it is required and missing.
    const Json* value(std::string_view key, Need need, const char* rule);

    // Notes the key, if it is there, as one that this object must not have.
    void refuse(std::string_view key, const std::string& why);
    void finish();

private:
    const Json* object_ = nullptr;
    Mistakes& mistakes_;
    std::vector<std::string_view> known_;
};

}  // namespace cairn::scene_detail
