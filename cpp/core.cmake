# How the core is compiled, whoever it is a part of: the modules of the plugin, the benchmarks.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)

option(MLRT_CHECKS "Assert invariants inside the core (slow; test builds)" OFF)
set(MLRT_SANITIZE "" CACHE STRING "Sanitizers of the whole core, e.g. address,undefined")

find_package(Python 3.11 REQUIRED COMPONENTS Interpreter Development.Module)

# nanobind and drjit are wheels beside the building interpreter: ask Python where they are.
execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir
    OUTPUT_STRIP_TRAILING_WHITESPACE OUTPUT_VARIABLE nanobind_ROOT
    COMMAND_ERROR_IS_FATAL ANY)
find_package(nanobind CONFIG REQUIRED)

function(mlrt_find_package_folder package result)
    execute_process(COMMAND ${Python_EXECUTABLE} -c
        "import importlib.util as u; print(u.find_spec('${package}').submodule_search_locations[0])"
        OUTPUT_STRIP_TRAILING_WHITESPACE OUTPUT_VARIABLE folder
        COMMAND_ERROR_IS_FATAL ANY)
    set(${result} ${folder} PARENT_SCOPE)
endfunction()

mlrt_find_package_folder(drjit drjit_root)

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    set(MLRT_ISA_NAMES avx2 avx512 CACHE STRING "Instruction sets to build modules for")
    set(isa_names ${MLRT_ISA_NAMES})
    set(isa_flags_avx2 -march=x86-64-v3)
    set(isa_flags_avx512 -march=x86-64-v4)
else()
    set(isa_names native)
    set(isa_flags_native "")
endif()

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    include(CheckCXXCompilerFlag)
    check_cxx_compiler_flag(-mmove-max=256 MLRT_HAS_MOVE_MAX)
endif()

# A Python module of parts of the core, for one instruction set.
function(mlrt_add_module module isa)
    # Sanitizers tell where they find something by the symbols.
    set(symbols "")
    if(MLRT_SANITIZE)
        set(symbols NOSTRIP)
    endif()
    # NOMINSIZE: nanobind's default of -Os makes the kernels 8 to 15 times slower.
    nanobind_add_module(${module} NOMINSIZE ${symbols} NB_STATIC NB_DOMAIN mlrt${module}
        ${ARGN})
    target_compile_definitions(${module} PRIVATE
        MLRT_MODULE=${module} MLRT_ISA_NAME="${isa}"
        $<$<BOOL:${MLRT_CHECKS}>:MLRT_CHECKS> $<$<NOT:$<CONFIG:Debug>>:NDEBUG>)
    target_include_directories(${module} PRIVATE ${CMAKE_CURRENT_FUNCTION_LIST_DIR})
    target_include_directories(${module} SYSTEM PRIVATE ${drjit_root}/include)
    # No contraction: a*b+c in one rounding makes two triangles disagree about their shared edge.
    target_compile_options(${module} PRIVATE ${isa_flags_${isa}}
        -O3 -ffp-contract=off -fno-math-errno -fno-trapping-math -fvisibility=hidden
        -Wall -Wextra)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
        # Unique symbols would be shared by the modules of two instruction sets. GCC 12 takes the
        # undefined operand of its own AVX-512 intrinsics for a mistake (PR105593).
        target_compile_options(${module} PRIVATE
            -fno-gnu-unique -Wno-uninitialized -Wno-maybe-uninitialized)
        # Packets are two registers each there: GCC finds functions of them too large to inline,
        # and passes packets through memory. Frames and rays took 3 to 8 % longer.
        if(isa STREQUAL "avx2")
            target_compile_options(${module} PRIVATE
                --param=max-inline-insns-auto=80 --param=large-stack-frame=8192)
            # It copies them by 16 bytes, and what is then read by 32 waits until all of it
            # has left the processor's store buffer.
            if(MLRT_HAS_MOVE_MAX)
                target_compile_options(${module} PRIVATE -mmove-max=256 -mstore-max=256)
            endif()
        endif()
    endif()
    target_link_libraries(${module} PRIVATE ${drjit_root}/libnanothread.so)
    if(MLRT_SANITIZE)
        # Less optimisation compiles in half the time, and what is reported is easier to read.
        target_compile_options(${module} PRIVATE -fsanitize=${MLRT_SANITIZE} -g -O1
            -fno-omit-frame-pointer)
        target_link_options(${module} PRIVATE -fsanitize=${MLRT_SANITIZE})
    endif()
endfunction()
