"""What compiled methods ask of numba's runtime, as LLVM's text: arrays and lists of their own.

numba's own runtime comes with the whole package, and part of it calls Python. This one calls the C library
alone. ``info`` is numba's `MemInfo`: counter of references, destructor, its argument, data, size, allocator.
The counter itself is changed by code that numba puts into each function.
"""

RUNTIME = """
declare noalias ptr @malloc(i64)
declare ptr @realloc(ptr, i64)
declare void @free(ptr)

define noalias ptr @NRT_Allocate(i64 %size) {
  %memory = call ptr @malloc(i64 %size)
  ret ptr %memory
}

define ptr @NRT_Reallocate(ptr %memory, i64 %size) {
  %moved = call ptr @realloc(ptr %memory, i64 %size)
  ret ptr %moved
}

define void @NRT_Free(ptr %memory) {
  call void @free(ptr %memory)
  ret void
}

define void @quadvis_fill(ptr %info, ptr %data, i64 %size, ptr %destructor, ptr %argument) {
  store i64 1, ptr %info
  %p1 = getelementptr i64, ptr %info, i64 1
  store ptr %destructor, ptr %p1
  %p2 = getelementptr i64, ptr %info, i64 2
  store ptr %argument, ptr %p2
  %p3 = getelementptr i64, ptr %info, i64 3
  store ptr %data, ptr %p3
  %p4 = getelementptr i64, ptr %info, i64 4
  store i64 %size, ptr %p4
  %p5 = getelementptr i64, ptr %info, i64 5
  store ptr null, ptr %p5
  ret void
}

define noalias ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %a = zext i32 %align to i64
  %head = add i64 %a, 48
  %whole = add i64 %head, %size
  %info = call ptr @malloc(i64 %whole)
  %none = icmp eq ptr %info, null
  br i1 %none, label %end, label %fill
fill:
  %start = ptrtoint ptr %info to i64
  %last = add i64 %head, %start
  %before = sub i64 %last, 1
  %mask = sub i64 0, %a
  %place = and i64 %before, %mask
  %data = inttoptr i64 %place to ptr
  call void @quadvis_fill(ptr %info, ptr %data, i64 %size, ptr null, ptr null)
  br label %end
end:
  ret ptr %info
}

define noalias ptr @NRT_MemInfo_alloc(i64 %size) {
  %info = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 16)
  ret ptr %info
}

define noalias ptr @NRT_MemInfo_new_varsize_dtor(i64 %size, ptr %destructor) {
  %info = call ptr @malloc(i64 48)
  %none = icmp eq ptr %info, null
  br i1 %none, label %end, label %take
take:
  %data = call ptr @malloc(i64 %size)
  %nothing = icmp eq ptr %data, null
  br i1 %nothing, label %fail, label %fill
fill:
  call void @quadvis_fill(ptr %info, ptr %data, i64 %size, ptr @quadvis_free_list, ptr %destructor)
  br label %end
fail:
  call void @free(ptr %info)
  br label %end
end:
  %result = phi ptr [null, %0], [%info, %fill], [null, %fail]
  ret ptr %result
}

define noalias ptr @NRT_MemInfo_new_varsize(i64 %size) {
  %info = call ptr @NRT_MemInfo_new_varsize_dtor(i64 %size, ptr null)
  ret ptr %info
}

define ptr @NRT_MemInfo_varsize_realloc(ptr %info, i64 %size) {
  %p3 = getelementptr i64, ptr %info, i64 3
  %p4 = getelementptr i64, ptr %info, i64 4
  %data = load ptr, ptr %p3
  %moved = call ptr @realloc(ptr %data, i64 %size)
  %none = icmp eq ptr %moved, null
  br i1 %none, label %end, label %keep
keep:
  store ptr %moved, ptr %p3
  store i64 %size, ptr %p4
  br label %end
end:
  ret ptr %moved
}

define void @NRT_MemInfo_varsize_free(ptr %info, ptr %memory) {
  %p3 = getelementptr i64, ptr %info, i64 3
  %data = load ptr, ptr %p3
  call void @free(ptr %memory)
  %mine = icmp eq ptr %data, %memory
  br i1 %mine, label %clear, label %end
clear:
  store ptr null, ptr %p3
  br label %end
end:
  ret void
}

define void @quadvis_free_list(ptr %data, i64 %size, ptr %destructor) {
  %none = icmp eq ptr %destructor, null
  br i1 %none, label %end, label %elements
elements:
  call void %destructor(ptr %data, i64 %size, ptr null)
  br label %end
end:
  call void @free(ptr %data)
  ret void
}

define void @NRT_MemInfo_call_dtor(ptr %info) {
  %p1 = getelementptr i64, ptr %info, i64 1
  %destructor = load ptr, ptr %p1
  %none = icmp eq ptr %destructor, null
  br i1 %none, label %end, label %destroy
destroy:
  %p2 = getelementptr i64, ptr %info, i64 2
  %argument = load ptr, ptr %p2
  %p3 = getelementptr i64, ptr %info, i64 3
  %data = load ptr, ptr %p3
  %p4 = getelementptr i64, ptr %info, i64 4
  %size = load i64, ptr %p4
  call void %destructor(ptr %data, i64 %size, ptr %argument)
  br label %end
end:
  call void @free(ptr %info)
  ret void
}

declare double @frexp(double, ptr)
declare double @ldexp(double, i32)

define double @numba_frexp(double %x, ptr %exponent) {
  %parted = call double @frexp(double %x, ptr %exponent)
  %nothing = fmul double %x, 0.0
  %finite = fcmp oeq double %nothing, 0.0
  br i1 %finite, label %end, label %other
other:
  store i32 0, ptr %exponent
  br label %end
end:
  %result = phi double [%parted, %0], [%x, %other]
  ret double %result
}

define double @numba_ldexp(double %x, i32 %exponent) {
  %result = call double @ldexp(double %x, i32 %exponent)
  ret double %result
}

; Strides of a reshaped array that lies in one piece row by row; 0 for others, which the interpreter reshapes.
define i32 @numba_attempt_nocopy_reshape(i64 %n, ptr %dims, ptr %strides, i64 %m, ptr %newdims,
    ptr %newstrides, i64 %itemsize, i32 %fortran) {
  %other = icmp ne i32 %fortran, 0
  br i1 %other, label %no, label %check
check:
  %i = phi i64 [%n, %0], [%i1, %next]
  %expected = phi i64 [%itemsize, %0], [%larger, %next]
  %checked = icmp eq i64 %i, 0
  br i1 %checked, label %fill, label %one
one:
  %i1 = sub i64 %i, 1
  %pd = getelementptr i64, ptr %dims, i64 %i1
  %d = load i64, ptr %pd
  %ps = getelementptr i64, ptr %strides, i64 %i1
  %s = load i64, ptr %ps
  %same = icmp eq i64 %s, %expected
  %single = icmp eq i64 %d, 1
  %fits = or i1 %same, %single
  br i1 %fits, label %next, label %no
next:
  %larger = mul i64 %expected, %d
  br label %check
fill:
  %j = phi i64 [%m, %check], [%j1, %put]
  %stride = phi i64 [%itemsize, %check], [%wider, %put]
  %filled = icmp eq i64 %j, 0
  br i1 %filled, label %yes, label %put
put:
  %j1 = sub i64 %j, 1
  %pn = getelementptr i64, ptr %newstrides, i64 %j1
  store i64 %stride, ptr %pn
  %pm = getelementptr i64, ptr %newdims, i64 %j1
  %e = load i64, ptr %pm
  %wider = mul i64 %stride, %e
  br label %fill
yes:
  ret i32 1
no:
  ret i32 0
}
"""
