/* The functions of FMI 3.0 that no test calls, and without which fmpy loads no library: all refuse (3, Error). */
#define REFUSE(name) int fmi3##name(void) { return 3; }
REFUSE(ActivateModelPartition) REFUSE(EnterConfigurationMode) REFUSE(ExitConfigurationMode)
REFUSE(EvaluateDiscreteStates) REFUSE(GetAdjointDerivative) REFUSE(GetDirectionalDerivative)
REFUSE(GetBinary) REFUSE(SetBinary) REFUSE(GetClock) REFUSE(SetClock) REFUSE(GetEventIndicators)
REFUSE(GetIntervalDecimal) REFUSE(GetIntervalFraction) REFUSE(GetShiftDecimal) REFUSE(GetShiftFraction)
REFUSE(SetIntervalDecimal) REFUSE(SetIntervalFraction) REFUSE(SetShiftDecimal) REFUSE(SetShiftFraction)
REFUSE(GetNominalsOfContinuousStates) REFUSE(GetNumberOfContinuousStates) REFUSE(GetNumberOfEventIndicators)
REFUSE(GetNumberOfVariableDependencies) REFUSE(GetOutputDerivatives) REFUSE(GetVariableDependencies)
