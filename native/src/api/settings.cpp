// SPDX-License-Identifier: GPL-3.0-or-later
#include <iterator>

#include "api/border.h"
#include "job/setting_table.h"

using namespace raybundle;

namespace {

// Names and help texts of the values of a choice, as C arrays.
template <class Choice>
struct ChoiceTexts {
    static constexpr size_t count = std::size(rowsOf(Choice{}));
    const char* names[count]{};
    const char* help[count]{};

    constexpr ChoiceTexts() {
        for (size_t k = 0; k < count; ++k) {
            names[k] = rowsOf(Choice{})[k].name;
            help[k] = rowsOf(Choice{})[k].help;
        }
    }
};

template <class Choice>
constexpr ChoiceTexts<Choice> kTexts;

rb_setting_info describe(const Setting& setting) {
    rb_setting_info info{};
    info.name = setting.name;
    info.help = setting.help;
    info.unit = setting.unit;
    info.used_with = setting.usedWith.choice;
    info.used_with_choices = setting.usedWith.values;
    std::visit(
        [&](auto member) {
            using Value = ValueOf<decltype(member)>;
            const Value value = Settings().*member;
            if constexpr (std::is_enum_v<Value>) {
                info.type = RB_SETTING_CHOICE;
                info.default_choice = choiceName(value);
                info.choice_count = kTexts<Value>.count;
                info.choices = kTexts<Value>.names;
                info.choice_help = kTexts<Value>.help;
            } else {
                info.type = std::is_same_v<Value, int> ? RB_SETTING_INT : RB_SETTING_FLOAT;
                info.least = setting.least;
                info.most = setting.most;
                info.default_number = double(value);
            }
        },
        setting.member);
    return info;
}

}  // namespace

size_t rb_get_setting_count(void) { return std::size(kSettings); }

rb_error rb_get_setting_info(size_t index, rb_setting_info* info) {
    return guarded([&] {
        if (index >= std::size(kSettings))
            throw invalidArgument("index must be less than " +
                                  std::to_string(std::size(kSettings)) +
                                  ", the number of settings");
        fillStruct(info, describe(kSettings[index]), "info");
    });
}
