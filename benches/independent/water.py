"""Water and its film in a round channel: properties from 5 to 40 degC, Konakov's friction, Gnielinski's film."""

import math


def properties(celsius):
    """Density, specific heat, viscosity and conductivity (SI): polynomials fitted to IAPWS-95, 5 to 40 degC."""
    x = (celsius - 22.5) / 17.5
    density = 997.7079 - 4.067856 * x - 1.566046 * x**2 + 0.1900965 * x**3
    heat = 4182.083 - 9.304152 * x + 9.680501 * x**2 - 3.416477 * x**3
    viscosity = math.exp(-6.966516 - 0.4129719 * x + 0.05396346 * x**2 - 0.009022698 * x**3)
    conductivity = 0.6024503 + 0.03018418 * x - 0.004257554 * x**2
    return density, heat, viscosity, conductivity


def prandtl(celsius):
    _, heat, viscosity, conductivity = properties(celsius)
    return viscosity * heat / conductivity


def friction(reynolds):
    """Darcy's friction factor of a smooth pipe; laminar to 2300, straight in Re to 4000, then Konakov."""
    def konakov(re):
        return (1.8 * math.log10(re) - 1.5) ** -2
    if reynolds <= 2300:
        return 64 / max(reynolds, 1e-9)
    if reynolds >= 4000:
        return konakov(reynolds)
    share = (reynolds - 2300) / 1700
    return (1 - share) * 64 / 2300 + share * konakov(4000)


def nusselt(reynolds, pr, slender):
    """Mean Nusselt number over the run for uniform heat flux and a developing profile; slender is d/L."""
    def laminar(re):
        thermal = 1.953 * (re * pr * slender) ** (1 / 3) - 0.6
        entrance = 0.924 * pr ** (1 / 3) * (re * slender) ** 0.5
        return (4.364**3 + 0.6**3 + thermal**3 + entrance**3) ** (1 / 3)

    def turbulent(re):
        eighth = friction(re) / 8
        plain = eighth * (re - 1000) * pr / (1 + 12.7 * eighth**0.5 * (pr ** (2 / 3) - 1))
        return plain * (1 + slender ** (2 / 3))

    if reynolds <= 2300:
        return laminar(reynolds)
    if reynolds >= 4000:
        return turbulent(reynolds)
    share = (reynolds - 2300) / 1700
    return (1 - share) * laminar(2300) + share * turbulent(4000)


def film(flow, diameter, length, bulk, wall):
    """Film coefficient and pressure drop without minor losses of a mass flow in kg/s at its mean temperature."""
    density, _, viscosity, conductivity = properties(bulk)
    reynolds = 4 * flow / (math.pi * diameter * viscosity)
    pr = prandtl(bulk)
    h = nusselt(reynolds, pr, diameter / length) * (pr / prandtl(wall)) ** 0.11 * conductivity / diameter
    velocity = flow / (density * math.pi * diameter**2 / 4)
    drop = friction(reynolds) * length / diameter * density * velocity**2 / 2
    return h, drop
