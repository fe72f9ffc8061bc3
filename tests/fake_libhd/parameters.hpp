// SPDX-License-Identifier: MIT
#pragma once

namespace fake_libhd {

/// The types that a parameter may be asked for in.
enum : unsigned { as_truth = 1, as_integer = 2, as_float = 4, as_double = 8, as_long = 16, as_text = 32, as_real = as_float | as_double };

struct Parameter {
  unsigned number;
  unsigned types;
  int count;
  bool of_state;   // belongs to a frame
};

/// All that the interface names and a Touch has, from its published tables.
inline constexpr Parameter parameters[] = {
    {0x2000, as_integer, 1, true},  {0x2200, as_integer, 1, true},  {0x2001, as_truth, 1, true},  {0x2201, as_truth, 1, true},
    {0x2002, as_truth, 1, true},    {0x2202, as_truth, 1, true},    {0x2010, as_long, 6, true},   {0x2210, as_long, 6, true},
    {0x2050, as_real, 3, true},     {0x2250, as_real, 3, true},     {0x2051, as_real, 3, true},   {0x2251, as_real, 3, true},
    {0x2052, as_real, 16, true},    {0x2252, as_real, 16, true},    {0x2053, as_real, 3, true},   {0x2253, as_real, 3, true},
    {0x2100, as_real, 3, true},     {0x2300, as_real, 3, true},     {0x2150, as_real, 3, true},   {0x2350, as_real, 3, true},
    {0x2500, as_text, 1, false},    {0x2501, as_text, 1, false},    {0x2502, as_text, 1, false},  {0x2503, as_text, 1, false},
    {0x2504, as_text, 1, false},    {0x2505, as_real, 1, false},    {0x2550, as_real, 6, false},  {0x2551, as_real, 6, false},
    {0x2552, as_float, 1, false},   {0x2553, as_integer, 1, false}, {0x2554, as_integer, 1, false}, {0x2555, as_integer, 1, false},
    {0x2600, as_integer, 1, false}, {0x2601, as_integer, 1, false}, {0x2602, as_real, 1, false},  {0x2603, as_real, 1, false},
    {0x2604, as_real, 1, false},    {0x2605, as_real, 3, false},    {0x2606, as_real, 1, false},  {0x2607, as_real, 1, false},
    {0x2608, as_real, 1, false},    {0x2609, as_real, 1, false},    {0x2622, as_real, 1, false},  {0x2623, as_real, 1, false},
    {0x2700, as_real, 3, true},     {0x2701, as_real, 3, true},     {0x2703, as_real, 3, true},   {0x2704, as_real, 3, true},
    {0x2750, as_long, 3, true},     {0x2800, as_real, 3, true},     {0x2801, as_real, 3, true}};

inline Parameter const* find_parameter(unsigned number) {
  for (Parameter const& parameter : parameters)
    if (parameter.number == number) return &parameter;
  return nullptr;
}

inline char const* words(unsigned code) {
  switch (code) {
    case 0: return "nothing is wrong";
    case 0x100: return "no such name";
    case 0x101: return "no such value";
    case 0x102: return "not now";
    case 0x103: return "wrong type";
    case 0x104: return "no such device";
    case 0x200: return "the motors are warm";
    case 0x201: return "more force than allowed";
    case 0x202: return "force too sudden";
    case 0x203: return "too fast";
    case 0x204: return "the force could not be given";
    case 0x300: return "the device is at fault";
    case 0x301: return "the device is open already";
    case 0x302: return "the device does not answer";
    case 0x303: return "the connection is not set up";
    case 0x304: return "no timer";
    case 0x400: return "frame begun twice";
    case 0x401: return "frame ended without a beginning";
    case 0x402: return "not in a frame";
    case 0x500: return "no such priority";
    case 0x501: return "the scheduler is full";
    case 0x600: return "no licence";
    default: return "unknown error";
  }
}

}  // namespace fake_libhd
