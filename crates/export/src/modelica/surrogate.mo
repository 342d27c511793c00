within ;
//! head
//! constants

  function evaluate "Values and bands of all points, and what is left to the limits"
//! interface
  protected
    Real scaled[scalings];
    Real powers[scalings * 13];
    Real variance;
    Real apart;
    Real product;
    Real square;
    Integer place;
//? uncertain
    Real slopes[max(1, points * parameters)];
    Real grown;
    Real towards;
//? end
  algorithm
    // Scaled variables and their powers.
//! scalings
    for i in 1:scalings loop
      powers[(i - 1) * 13 + 1] := 1.0;
      for k in 1:12 loop
        powers[(i - 1) * 13 + k + 1] := powers[(i - 1) * 13 + k] * scaled[i];
      end for;
    end for;

    // Polynomials.
    for i in 1:points loop
      values[i] := 0.0;
    end for;
//! polynomials
//? bases

    // Radial bases.
//! bases
//? end
//? uncertain

    // Slopes of every point along the parameters, and what the distance from the measured conditions adds.
    for i in 1:points * parameters loop
      slopes[i] := 0.0;
    end for;
    for i in 1:slope_terms loop
      product := 1.0;
      for v in 1:variables loop
        product := product * powers[slope_scalings[v] * 13 + slope_exponents[(i - 1) * variables + v] + 1];
      end for;
      for j in 1:points loop
        for k in 1:parameters loop
          place := (j - 1) * parameters + k;
          slopes[place] := slopes[place] + product * slope_table[((j - 1) * slope_terms + i - 1) * parameters + k];
        end for;
      end for;
    end for;
    square := 0.0;
    for v in 1:variables loop
      if measured_halves[v] > 0.0 then
        apart := (x[v] - measured_centre[v]) / measured_halves[v];
        square := square + apart * apart;
      end if;
    end for;
    grown := growth * growth * square;
//? end

    // Bands.
    for i in 1:points loop
      variance := (half_widths[i] / 1.959963984540054) * (half_widths[i] / 1.959963984540054);
//? uncertain
      variance := variance + missed_variance[i] + grown * (missed_own[i] * missed_own[i] + missed_common[i] * missed_common[i]);
      for k in 1:parameters loop
        place := (i - 1) * parameters + k;
//? known
        towards := 2.0 * missed_cross[place];
        for j in 1:parameters loop
          towards := towards + parameter_covariance[(k - 1) * parameters + j] * slopes[(i - 1) * parameters + j];
        end for;
//? else
        towards := slopes[place];
//? end
        variance := variance + slopes[place] * towards;
      end for;
//? end
      // Rounding must not leave a negative variance.
      bands[i] := 1.959963984540054 * sqrt(max(variance, 0.0));
    end for;
//? known

    // What the mean of the states adds.
    for i in 1:points loop
      values[i] := values[i] + missed_mean[i];
      for k in 1:parameters loop
        values[i] := values[i] + slopes[(i - 1) * parameters + k] * parameter_mean[k];
      end for;
    end for;
//? end
//? limits

    // Limits.
//! limits
//? end
  end evaluate;

  block Surrogate "The surrogate, with inputs and outputs in the order of the constants of names"
//! block
  equation
//! equations
  end Surrogate;
//? moving

  function at_rest_in "The states of the steady state"
    input Real x[variables] "A value per variable, in its unit";
    output Real steady[states_count];
  protected
    Real scaled[scalings];
    Real powers[scalings * 13];
    Real product;
  algorithm
//! scalings
    for i in 1:scalings loop
      powers[(i - 1) * 13 + 1] := 1.0;
      for k in 1:12 loop
        powers[(i - 1) * 13 + k + 1] := powers[(i - 1) * 13 + k] * scaled[i];
      end for;
    end for;
    for k in 1:states_count loop
      steady[k] := 0.0;
    end for;
    for i in 1:steady_terms loop
      product := 1.0;
      for v in 1:variables loop
        product := product * powers[steady_scalings[v] * 13 + steady_exponents[(i - 1) * variables + v] + 1];
      end for;
      for k in 1:states_count loop
        steady[k] := steady[k] + product * steady_coefficients[(i - 1) * states_count + k];
      end for;
    end for;
  end at_rest_in;

  function at_temperature "The states in which everything has one temperature"
    input Real temperature "In the unit of the points";
    output Real uniform_states[states_count];
  algorithm
    for k in 1:states_count loop
      uniform_states[k] := uniform[k] + uniform[states_count + k] * temperature;
    end for;
  end at_temperature;

  function motion "How the states move, and what they add to the values of the points"
    input Real x[variables] "A value per variable, in its unit";
    input Real states[states_count];
    output Real slopes[states_count] "In a second";
    output Real added[points];
  protected
    Real scaled[scalings];
    Real powers[scalings * 13];
    Real steady[states_count];
    Real product;
  algorithm
//! scalings
    for i in 1:scalings loop
      powers[(i - 1) * 13 + 1] := 1.0;
      for k in 1:12 loop
        powers[(i - 1) * 13 + k + 1] := powers[(i - 1) * 13 + k] * scaled[i];
      end for;
    end for;
    for k in 1:states_count loop
      steady[k] := 0.0;
    end for;
    for i in 1:steady_terms loop
      product := 1.0;
      for v in 1:variables loop
        product := product * powers[steady_scalings[v] * 13 + steady_exponents[(i - 1) * variables + v] + 1];
      end for;
      for k in 1:states_count loop
        steady[k] := steady[k] + product * steady_coefficients[(i - 1) * states_count + k];
      end for;
    end for;
    for k in 1:states_count loop
      slopes[k] := 0.0;
    end for;
    for i in 1:points loop
      added[i] := 0.0;
    end for;
    for i in 1:moving_terms loop
      product := 1.0;
      for v in 1:variables loop
        product := product * powers[moving_scalings[v] * 13 + moving_exponents[(i - 1) * variables + v] + 1];
      end for;
      for k in 1:states_count loop
        for j in 1:states_count loop
          slopes[j] := slopes[j] - product * rate_table[((i - 1) * states_count + k - 1) * states_count + j] * (states[k] - steady[k]);
        end for;
        for j in 1:points loop
          added[j] := added[j] + product * outputs[((j - 1) * moving_terms + i - 1) * states_count + k] * (states[k] - steady[k]);
        end for;
      end for;
    end for;
  end motion;

  block InTime "The surrogate over time: what the points read while x goes on"
    parameter Boolean at_rest = true "Whether it begins in the steady state of x";
    parameter Real initial_temperature = 20.0 "What everything has at the beginning otherwise, in the unit of the points";
    input Real x[variables] "A value per variable, in its unit";
    output Real now[points] "What the points read, in their units";
    Real states[states_count];
    Real slopes[states_count];
    Real added[points];
    Real values[points] "In the steady state";
//! outputs
    (slopes, added) = motion(x, states);
    der(states) = slopes;
    now = values + added;
  end InTime;
//? end
//! tail
