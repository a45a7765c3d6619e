/* Included at the end of the S-function by both trailers. */
#define STAND_IN_TEXT2(x) #x
#define STAND_IN_TEXT(x) STAND_IN_TEXT2(x)

#ifdef MDL_START
#error "mdlStart: nothing is to be allocated or opened"
#endif
#ifdef MDL_DERIVATIVES
#error "mdlDerivatives: there are no continuous states"
#endif
#ifndef MDL_UPDATE
#error "mdlUpdate is missing or not announced by MDL_UPDATE"
#endif
#ifndef MDL_INITIALIZE_CONDITIONS
#error "mdlInitializeConditions is missing or not announced by MDL_INITIALIZE_CONDITIONS"
#endif

const standin_methods standin_sfunction = {
    STAND_IN_TEXT(S_FUNCTION_NAME),
#ifdef MATLAB_MEX_FILE
    1,
#else
    0,
#endif
    mdlInitializeSizes,
    mdlInitializeSampleTimes,
#ifdef MDL_CHECK_PARAMETERS
    mdlCheckParameters,
#else
    NULL,
#endif
#ifdef MDL_SET_WORK_WIDTHS
    mdlSetWorkWidths,
#else
    NULL,
#endif
#ifdef MDL_RTW
    mdlRTW,
#else
    NULL,
#endif
    mdlInitializeConditions,
    mdlOutputs,
    mdlUpdate,
    mdlTerminate
};
