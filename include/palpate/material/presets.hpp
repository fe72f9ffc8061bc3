// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/material/isotropic.hpp>

#include <array>
#include <ostream>
#include <string_view>

namespace palpate {

/// Numbers of a tissue and what is known of their measurement. What no source supports is not a preset.
///   FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = liver_material.density, .material = liver_material});
/// Source     the measured modulus: `source` of each. Densities: \cite cardoso2012 table 3.
/// Limits     small strain, one modulus for loading and unloading, no layers, no capsule. Poisson's ratio is an assumption throughout: none of the pages
///            named states one. Methods differ by a factor of four and more for the same tissue: fit to a measurement of one's own where there is one.
struct MaterialPreset {
  std::string_view name;      ///< "liver" for liver_material
  std::string_view tissue;
  std::string_view species;
  std::string_view method;    ///< and whether in vivo
  std::string_view strain;    ///< how far it was strained
  double young = 0.0;         ///< Pa
  double poisson = 0.0;       ///< assumed
  double density = 0.0;       ///< kg/m³
  std::string_view measured;  ///< the number as the source prints it; E = 2 μ (1 + ν) where that is a shear modulus
  std::string_view source;
  std::string_view limits;

  /// Any isotropic law with these numbers: StableNeoHookean<double> material = liver_material.
  template <template <class> class Law, RealScalar Scalar>
  constexpr operator IsotropicMaterial<Law, Scalar>() const noexcept {
    return {static_cast<Scalar>(young), static_cast<Scalar>(poisson)};
  }
};

/// What all of them take from elsewhere or assume.
inline constexpr std::string_view material_density_source = "Cardoso and Cowin 2012, Mechanics of Materials 44, table 3, doi 10.1016/j.mechmat.2011.08.007, PMC3233242";
inline constexpr double assumed_poisson = 0.49;

namespace detail {
constexpr double young_of_shear(double shear) noexcept { return 2 * shear * (1 + assumed_poisson); }
}  // namespace detail

inline constexpr std::array<MaterialPreset, 6> material_presets{{
    {"liver", "liver", "pig", "unconfined compression at several rates, ex vivo, without pre-stress (epsilon-dot method)",
     "small, the linear region; no bound in the abstract", 2040.0, assumed_poisson, 1060.0, "E = 2.04 kPa (0.01), instantaneous",
     "Mattei, Tirella, Gallone and Ahluwalia 2014, Viscoelastic characterisation of pig liver in unconfined compression, Journal of Biomechanics; abstract, "
     "https://arpi.unipi.it/handle/11568/486469",
     "The instantaneous modulus: what is held relaxes. Without perfusion. A dynamic test in the same work gave 2.65 kPa."},
    {"kidney", "cortex of the kidney", "pig", "shear waves of 50 to 500 Hz by ultrasound (SDUV), ex vivo, 8 kidneys", "infinitesimal, waves",
     detail::young_of_shear(1810.0), assumed_poisson, 1050.0, "shear elasticity 1.81 kPa (0.17), beside a viscosity of 1.48 Pa s (0.49)",
     "Amador and others 2011, Shearwave dispersion ultrasound vibrometry (SDUV) on swine kidney, IEEE Transactions on Ultrasonics, Ferroelectrics, and "
     "Frequency Control 58; abstract, https://mayoclinic.pure.elsevier.com/en/publications/shearwave-dispersion-ultrasound-vibrometry-sduv-on-swine-kidney",
     "Anisotropic and inhomogeneous, here a mean; of the cortex alone, without perfusion."},
    {"brain", "brain", "pig", "torsion of fresh cylinders at a constant twist rate, ex vivo", "finite torsion, fitted with the law of Mooney and Rivlin",
     detail::young_of_shear(900.0), assumed_poisson, 1040.0, "shear modulus 900 Pa (312)",
     "Balbi, Trotta, Destrade and Ni Annaidh 2019, Poynting effect of brain matter in torsion, Soft Matter 15, 5147; abstract, doi 10.1039/C9SM00131J, open access",
     "White and grey matter are not told apart. What is held relaxes. The second Mooney-Rivlin parameter, 297 Pa (189), has no place in these laws."},
    {"fat", "subcutaneous fat of the buttock", "human", "magnetic resonance elastography at 50 Hz, in vivo, 10 women", "infinitesimal, waves in undeformed tissue",
     detail::young_of_shear(752.0), assumed_poisson, 950.0, "|G*| = 752 Pa",
     "Hatt, Lloyd, Bolsterlee and Bilston 2023, Strain-dependent shear properties of human adipose tissue in vivo, Journal of the Mechanical Behavior of Biomedical "
     "Materials, 105924; abstract, doi 10.1016/j.jmbbm.2023.105924",
     "|G*| holds viscosity too. It stiffens steeply under compression: 748.5 C_yy^-1.18 Pa. Elastography of thighs gave 3.04 kPa (doi 10.1371/journal.pone.0138873)."},
    {"skin", "skin of the volar forearm", "human", "suction, thickness by ultrasound, in vivo, 10 men", "membrane sucked to a dome; no bound in the abstract", 129e3,
     assumed_poisson, 1090.0, "E = 129 kPa (88)",
     "Diridollou and others 2000, In vivo model of the mechanical properties of the human skin under suction, Skin Research and Technology 6, 214-221; abstract, "
     "https://acnpsearch.tweb-dev.unibo.it/singlejournalindex/76618235",
     "In its plane, all layers as one membrane. Not included: the tension at rest, 13.5 kPa (5). Reported moduli of skin span 5 kPa to 140 MPa with the method."},
    {"muscle", "passive gluteal muscle", "human", "magnetic resonance elastography at 50 Hz, in vivo, 10 women", "infinitesimal, waves in undeformed tissue",
     detail::young_of_shear(1000.0), assumed_poisson, 1050.0, "|G*| = 1000 Pa",
     "Hatt, Lloyd, Bolsterlee and Bilston 2023, Strain-dependent shear properties of human adipose tissue in vivo, Journal of the Mechanical Behavior of Biomedical "
     "Materials, 105924; abstract, doi 10.1016/j.jmbbm.2023.105924",
     "Isotropic, at rest, no fibres. |G*| holds viscosity too. Fast indentation across the fibres of porcine gluteus gave a shear modulus of 8.5 kPa that relaxed to "
     "0.7 kPa within 20 s (doi 10.1115/1.2264395)."},
}};

/// The preset of a name, or null.
constexpr MaterialPreset const* find_material_preset(std::string_view name) noexcept {
  for (MaterialPreset const& preset : material_presets)
    if (preset.name == name) return &preset;
  return nullptr;
}

inline constexpr MaterialPreset const& liver_material = *find_material_preset("liver");
inline constexpr MaterialPreset const& kidney_material = *find_material_preset("kidney");
inline constexpr MaterialPreset const& brain_material = *find_material_preset("brain");
inline constexpr MaterialPreset const& fat_material = *find_material_preset("fat");
inline constexpr MaterialPreset const& skin_material = *find_material_preset("skin");
inline constexpr MaterialPreset const& muscle_material = *find_material_preset("muscle");

/// What is known of it, a line a fact.
inline std::ostream& operator<<(std::ostream& out, MaterialPreset const& preset) {
  return out << preset.name << ": " << preset.tissue << ", species " << preset.species << "\n  Young's modulus  " << preset.young << " Pa, from " << preset.measured
             << "\n  Poisson's ratio  " << preset.poisson << ", an assumption\n  density          " << preset.density << " kg/m3, " << material_density_source
             << "\n  method           " << preset.method << "\n  strain           " << preset.strain << "\n  source           " << preset.source
             << "\n  limits           " << preset.limits << '\n';
}

}  // namespace palpate
