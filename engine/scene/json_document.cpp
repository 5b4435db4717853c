#include "engine/scene/detail/json_document.hpp"

#include <algorithm>
#include <string_view>

namespace cairn::scene_detail {

namespace {

// Builds the document event by event. The library's own builder lets the last of two equal keys win without a word.
class DocumentBuilder final : public nlohmann::json_sax<Json> {
public:
    DocumentBuilder(const std::string& text, Mistakes& mistakes) : text_(text), mistakes_(mistakes) {}

    Json take() { return std::move(root_); }

    bool null() override { return put(nullptr); }
    bool boolean(bool value) override { return put(value); }
    bool number_integer(number_integer_t value) override { return put(value); }
    bool number_unsigned(number_unsigned_t value) override { return put(value); }
    bool number_float(number_float_t value, const string_t&) override { return put(value); }
    bool string(string_t& value) override { return put(std::move(value)); }
    bool binary(binary_t&) override { return false; }  // does not occur in text

    bool start_object(std::size_t) override {
        open_.push_back(&place(Json::object()));
        keys_.emplace_back();
        return true;
    }
    bool start_array(std::size_t) override {
        open_.push_back(&place(Json::array()));
        keys_.emplace_back();
        return true;
    }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }

    bool key(string_t& name) override {
        keys_.back() = std::move(name);
        if (open_.back()->contains(keys_.back())) mistakes_.add_at(here(), "given twice in one object");
        return true;
    }

    bool parse_error(std::size_t position, const std::string& token, const nlohmann::detail::exception& error) override {
        // position counts the bytes read so far: the offending one is the last of them, or the end of the text.
        const std::size_t at = std::min(position == 0 ? 0 : position - 1, text_.size());
        const std::string_view before(text_.data(), at);
        const std::size_t line = 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
        const std::size_t start = before.rfind('\n') == std::string_view::npos ? 0 : before.rfind('\n') + 1;
        mistakes_.add_at("line " + std::to_string(line) + ", column " + std::to_string(at - start + 1), message(token, error) + remark(at));
        return false;
    }

private:
    static constexpr std::size_t kLongest = 160;

    static std::string message(const std::string& token, const nlohmann::detail::exception& error) {
        constexpr int kNumberOverflow = 406;
        if (error.id == kNumberOverflow) return token.substr(0, kLongest) + ", must be a finite number";
        std::string what = error.what();
        const std::size_t start = what.find("syntax error");
        if (start != std::string::npos) what.erase(0, start);
        if (what.size() > kLongest) what = what.substr(0, kLongest) + "…";
        return what;
    }

    // NaN, Infinity and -Infinity are what other writers put where JSON has no number.
    const char* remark(std::size_t at) const {
        const bool not_finite = at < text_.size() && (text_[at] == 'N' || text_[at] == 'I');
        return not_finite ? " (a number must be finite)" : "";
    }

    template <class Value>
    bool put(Value&& value) {
        place(Json(std::forward<Value>(value)));
        return true;
    }
    Json& place(Json&& value) {
        if (open_.empty()) return root_ = std::move(value);
        if (open_.back()->is_array()) {
            open_.back()->push_back(std::move(value));
            return open_.back()->back();
        }
        return (*open_.back())[keys_.back()] = std::move(value);
    }
    bool close() {
        open_.pop_back();
        keys_.pop_back();
        return true;
    }
    std::string here() const {
        std::vector<Step> path;
        for (std::size_t i = 0; i < open_.size(); ++i) {
            if (open_[i]->is_array()) {
                path.emplace_back(open_[i]->size() - 1);
            } else {
                path.emplace_back(std::string_view(keys_[i]));
            }
        }
        return place_text(path);
    }

    const std::string& text_;
    Mistakes& mistakes_;
    Json root_;
    std::vector<Json*> open_;        // containers that are not closed yet, outermost first; each the last child of the one before
    std::vector<std::string> keys_;  // of each open object, the key that is being read
};

}  // namespace

bool parse_json(const std::string& text, Mistakes& mistakes, Json& document) {
    DocumentBuilder builder(text, mistakes);
    const bool whole = Json::sax_parse(text, &builder);
    document = builder.take();
    return whole;
}

}  // namespace cairn::scene_detail
