// Declared in tpm/files/keys/file_kind.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/files/keys/file_kind.hpp"

namespace tpm::files {
namespace {

using Type = Form::Type;

/// Type of a key's value, in a cell of a table.
std::string type_cell(const Form& form) {
  const auto with_range = [&](std::string noun, std::string_view unit = {}) {
    const std::string range = form.range.words(unit);
    return range.empty() ? noun : fmt::format("{}, {}", noun, range);
  };
  const auto counted = [&] {
    constexpr auto kNoEnd = std::numeric_limits<std::size_t>::max();
    if (form.fewest == form.most) return fmt::format("{} times ", form.fewest);
    if (form.most == kNoEnd) return fmt::format("{} or more times ", form.fewest);
    return fmt::format("{} to {} times ", form.fewest, form.most);
  };
  switch (form.type) {
    case Type::any:
      return form.sentence;
    case Type::flag:
      return "true, false";
    case Type::whole:
      return with_range("whole number");
    case Type::number:
      return with_range("number");
    case Type::quantity:
      return with_range(std::string(dimension_name(form.dimension)), si_symbol(form.dimension)) +
             (form.plain_too ? ", or a number in SI" : "");
    case Type::text:
      return form.pattern.empty() ? "text" : form.sentence;
    case Type::word:
      return fmt::format("`{}`", fmt::join(form.words, "`, `"));
    case Type::list:
      if (!form.name.empty()) return form.name;
      return fmt::format("{}list: {}{}", form.one_too ? "one or " : "",
                         form.fewest > 0 ? counted() : "", type_cell(*form.item));
    case Type::map:
      return fmt::format("object of any keys: {}", type_cell(*form.item));
    case Type::block:
    case Type::kinds:
      return form.name.empty() ? "object" : fmt::format("[{0}](#{0})", form.name);
    case Type::either:
      return listed(
          form.forms, [](const FormPtr& one) { return type_cell(*one); }, ", or ");
    case Type::later:
      return type_cell(*form.made());
  }
  return {};
}

std::string plain_cell(std::string text) {
  std::string cell;
  for (const char c : text) cell += c == '|' ? std::string("\\|") : std::string(1, c);
  return cell;
}

std::string table(const std::vector<KeyForm>& keys) {
  if (keys.empty()) return "No further keys.\n\n";
  std::string text = "| key | value | default | meaning |\n| --- | --- | --- | --- |\n";
  for (const KeyForm& key : keys) {
    text += fmt::format("| `{}` | {} | {} | {} |\n", key.name, plain_cell(type_cell(*key.form)),
                        key.required          ? "required"
                        : key.usual.is_null() ? ""
                                              : fmt::format("`{}`", key.usual.dump()),
                        plain_cell(key.sentence));
  }
  return text + "\n";
}

class PageWriter {
 public:
  void add(const Form& form, const std::string& heading) {
    text_ += heading;
    if (!form.sentence.empty()) text_ += fmt::format("{}.\n\n", sentence_case(form.sentence));
    if (form.type == Type::block) text_ += table(form.keys);
    for (const KindForm& kind : form.kinds) {
      const std::string head = form.by.empty()
                                   ? fmt::format("With `{}`", kind.word)
                                   : fmt::format("`\"{}\": \"{}\"`", form.by, kind.word);
      text_ += fmt::format("{}{}{}{}\n\n", head, kind.word == form.usual_kind ? " (default)" : "",
                           kind.sentence.empty() ? "" : ": ", kind.sentence);
      text_ += table(kind.keys);
    }
    for (const std::string& rule : form.rules) {
      text_ += fmt::format("Rule: {}.\n\n", rule);
    }
    add_within(form.keys);
    for (const KindForm& kind : form.kinds) add_within(kind.keys);
  }

  [[nodiscard]] std::string text() && { return std::move(text_); }

 private:
  static std::string sentence_case(std::string text) {
    if (!text.empty())
      text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    return text;
  }

  void add_within(const std::vector<KeyForm>& keys) {
    for (const KeyForm& key : keys) add_named(*key.form);
  }

  void add_named(const Form& form) {
    if (form.made) return add_named(*form.made());
    if (form.item) add_named(*form.item);
    for (const FormPtr& one : form.forms) add_named(*one);
    if (form.type != Type::block && form.type != Type::kinds) return;
    if (form.name.empty() || !seen_.insert(form.name).second) return;
    add(form, fmt::format("### {}\n\n", form.name));
  }

  std::string text_;
  std::set<std::string> seen_;
};

Json example_value(const Form& form);

void add_examples(const std::vector<KeyForm>& keys, Json& object) {
  for (const KeyForm& key : keys) {
    if (!key.example.is_null()) {
      object[key.name] = key.example;
    } else if (key.required) {
      object[key.name] = example_value(*key.form);
    }
  }
}

Json example_value(const Form& form) {
  if (!form.example.is_null()) return form.example;
  Json object = Json::object();
  switch (form.type) {
    case Type::any:
      return nullptr;
    case Type::flag:
      return true;
    case Type::whole:
      return static_cast<std::int64_t>(std::isfinite(form.range.least) ? form.range.least : 1.0);
    case Type::number:
      return std::isfinite(form.range.most) ? form.range.most : 1.0;
    case Type::quantity:
      return with_unit("2", shown_unit(form.dimension));
    case Type::text:
      return "a text";
    case Type::word:
      return form.words.front();
    case Type::list: {
      Json items = Json::array();
      for (std::size_t i = 0; i < std::max<std::size_t>(1, form.fewest); ++i) {
        items.push_back(example_value(*form.item));
      }
      return items;
    }
    case Type::map:
      return object;
    case Type::block:
      add_examples(form.keys, object);
      return object;
    case Type::kinds:
      if (!form.by.empty()) object[form.by] = form.kinds.front().word;
      add_examples(form.kinds.front().keys, object);
      return object;
    case Type::either:
      return example_value(*form.forms.front());
    case Type::later:
      return example_value(*form.made());
  }
  return nullptr;
}

}  // namespace

std::string keys_section(const FileKind& kind) {
  PageWriter page;
  Form form = *kind.form;
  form.sentence.clear();
  page.add(form, fmt::format("## {}\n\n{}. {}\n\n", kind.name, kind.title, kind.sentence));
  return std::move(page).text();
}

Json example_of(const FileKind& kind) {
  return example_value(*kind.form);
}

}  // namespace tpm::files
