// SPDX-License-Identifier: GPL-3.0-or-later
#include "job/settings.h"

#include "job/error.h"
#include "job/setting_table.h"

namespace raybundle {
namespace {

// Returns the setting `name` if `isOfType` accepts its pointer to member. Throws
// Error(INVALID_ARGUMENT) if there is none.
template <class IsOfType>
const Setting& find(const std::string& name, const IsOfType& isOfType) {
    for (const Setting& setting : kSettings)
        if (name == setting.name && std::visit(isOfType, setting.member)) return setting;
    throw invalidArgument("setting \"" + name + "\" does not exist or has another type");
}

// Returns the setting `name` whose values are of the type Number (int or float). Throws
// Error(INVALID_ARGUMENT) if there is none.
template <class Number>
const Setting& findNumber(const std::string& name) {
    return find(name,
                [](auto member) { return std::is_same_v<ValueOf<decltype(member)>, Number>; });
}

// Returns the setting `name` whose values are a choice. Throws Error(INVALID_ARGUMENT) if there is
// none.
const Setting& findChoice(const std::string& name) {
    return find(name, [](auto member) { return std::is_enum_v<ValueOf<decltype(member)>>; });
}

template <class Number>
Number Settings::*memberOf(const Setting& setting) {
    return std::get<Number Settings::*>(setting.member);
}

// Sets a number. Throws Error(INVALID_ARGUMENT) if the setting does not exist or the value is out
// of range or NaN.
template <class Number>
void setNumber(Settings& settings, const std::string& name, Number value) {
    const Setting& setting = findNumber<Number>(name);
    const Number least = Number(setting.least), most = Number(setting.most);
    if (!(value >= least && value <= most))
        throw invalidArgument("setting \"" + name + "\" must be between " + std::to_string(least) +
                              " and " + std::to_string(most));
    settings.*memberOf<Number>(setting) = value;
}

// Returns the value of a choice by its name. Throws Error(INVALID_ARGUMENT) if the choice has no
// value of this name.
template <class Choice>
Choice chosen(const std::string& name, const std::string& value) {
    std::string known;
    for (const auto& row : rowsOf(Choice{})) {
        if (value == row.name) return row.value;
        known += known.empty() ? row.name : std::string(", ") + row.name;
    }
    throw invalidArgument("setting \"" + name + "\" must be one of " + known + ", not \"" + value +
                          "\"");
}

}  // namespace

void Settings::set(const std::string& name, int value) { setNumber(*this, name, value); }

void Settings::set(const std::string& name, float value) { setNumber(*this, name, value); }

void Settings::set(const std::string& name, const std::string& value) {
    std::visit(
        [&](auto member) {
            using Value = ValueOf<decltype(member)>;
            if constexpr (std::is_enum_v<Value>) this->*member = chosen<Value>(name, value);
        },
        findChoice(name).member);
}

void Settings::get(const std::string& name, int& value) const {
    value = this->*memberOf<int>(findNumber<int>(name));
}

void Settings::get(const std::string& name, float& value) const {
    value = this->*memberOf<float>(findNumber<float>(name));
}

const char* Settings::get(const std::string& name) const {
    return std::visit(
        [&](auto member) -> const char* {
            if constexpr (std::is_enum_v<ValueOf<decltype(member)>>)
                return choiceName(this->*member);
            else
                return nullptr;  // unreachable: findChoice() accepts only choices
        },
        findChoice(name).member);
}

}  // namespace raybundle
