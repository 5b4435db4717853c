#include "engine/scene/detail/mistakes.hpp"

#include "engine/base/error.hpp"

#include <algorithm>
#include <numeric>

namespace cairn::scene_detail {

namespace {

// A key as it stands in a place: one line, not too long, whatever the file holds.
std::string printable(std::string_view key) {
    constexpr std::size_t kLongest = 64;
    std::string text(key.substr(0, kLongest));
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
    return key.size() > kLongest ? text + "…" : text;
}

}  // namespace

std::string place_text(const std::vector<Step>& path) {
    std::string text;
    for (const Step& step : path) {
        if (const std::size_t* index = std::get_if<std::size_t>(&step)) {
            text += '[' + std::to_string(*index) + ']';
        } else {
            if (!text.empty()) text += '.';
            text += printable(std::get<std::string_view>(step));
        }
    }
    return text;
}

void Mistakes::add_at(const std::string& place, const std::string& what) {
    if (++count_ > kMostMistakes) return;
    if (!lines_.empty()) lines_ += '\n';
    lines_ += source_ + ": ";
    if (!place.empty()) lines_ += place + ": ";
    lines_ += what;
}

void Mistakes::throw_if_any() const {
    if (count_ == 0) return;
    if (count_ <= kMostMistakes) throw Error(lines_);
    throw Error(lines_ + '\n' + source_ + ": and " + std::to_string(count_ - kMostMistakes) + " mistakes more");
}

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t change = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({change, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

}  // namespace

std::string_view nearest_word(std::string_view word, const std::vector<std::string_view>& known) {
    if (word.size() > 64) return {};
    std::string_view best;
    // As many edits as a third of the word, at least two: "mas", "half_extent", "collideConnected" find theirs, "colour" finds none.
    std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (const std::string_view candidate : known) {
        const std::size_t distance = edit_distance(word, candidate);
        if (distance < best_distance && distance < candidate.size()) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

}  // namespace cairn::scene_detail
