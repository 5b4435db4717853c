// Mistakes in a scene file, each with its place, gathered so that all of them are told in one go.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cairn::scene_detail {

// A way into a JSON document: keys and list indices from the root. Text: bodies[12].shapes[0].radius
using Step = std::variant<std::size_t, std::string_view>;
std::string place_text(const std::vector<Step>& path);

// Most lines that one Error holds; the rest is only counted (a broken mesh can have a mistake in each of 100,000 triangles).
constexpr std::size_t kMostMistakes = 1000;

class Mistakes {
public:
    explicit Mistakes(std::string source) : source_(std::move(source)) {}

    // While it lives, mistakes are placed one step deeper. A key must outlive the scope.
    class Scope {
    public:
        Scope(Mistakes& mistakes, Step step) : mistakes_(mistakes) { mistakes_.path_.push_back(step); }
        ~Scope() { mistakes_.path_.pop_back(); }
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        Mistakes& mistakes_;
    };

    // Notes "SOURCE: PLACE: WHAT" for the current place.
    void add(const std::string& what) { add_at(place_text(path_), what); }
    void add_at(const std::string& place, const std::string& what);

    std::size_t count() const { return count_; }
    // Throws Error with one line per mistake, if there is any.
    void throw_if_any() const;

private:
    std::string source_;
    std::vector<Step> path_;
    std::string lines_;
    std::size_t count_ = 0;
};

// The one of `known` that is nearest to `word` in edits (Levenshtein 1966), or nothing when none is near.
std::string_view nearest_word(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace cairn::scene_detail
